"""A drive as the standard has it: what is used where nothing else fits."""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(name="cia402", summary="any CiA 402 drive as the standard has it")
