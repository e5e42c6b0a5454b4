"""Drives on CANopenNode with the object dictionary that it brings: vendor id 0, sizes always given.

Its SYNC consumer ignores synchronous PDOs in a window (1007) and reports a SYNC that stays away where 1006 is
not 0, so 1006 is left alone.
"""

from __future__ import annotations

from drivers.setup.profiles.profile import Profile

PROFILE = Profile(name="canopennode", summary="drives on CANopenNode with its default object dictionary")
