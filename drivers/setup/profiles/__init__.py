"""Kinds of drives: what each needs beside the standard, chosen by name in robot.toml or by identity."""

from __future__ import annotations

from functools import lru_cache
from importlib import import_module
from pkgutil import iter_modules

from drivers.errors import DriveError
from drivers.setup.profiles.profile import Profile, StartUpWrite

__all__ = ["STANDARD", "Profile", "StartUpWrite", "choose_profile", "known_profiles"]

_SHAPE = "profile"
"""The module of the class itself."""
STANDARD = "cia402"


@lru_cache(maxsize=1)
def known_profiles() -> dict[str, Profile]:
    """Every file of this folder with a PROFILE, by its name."""
    names = [module.name for module in iter_modules(__path__) if module.name != _SHAPE]
    profiles = [import_module(f"{__name__}.{name}").PROFILE for name in names]
    return {profile.name: profile for profile in profiles}


def choose_profile(name: str | None, vendor: int | None, product: int | None, drive: str = "") -> Profile:
    """The kind of a drive.

    Args:
        name: as robot.toml has it; None where the identity decides.
        vendor, product: of the identity object (1018).
        drive: for the message.

    Raises:
        DriveError: no profile has this name.
    """
    known = known_profiles()
    if name is not None:
        if name not in known:
            raise DriveError(f"{drive}: no profile {name!r}; allowed: {', '.join(sorted(known))}")
        return known[name]
    for profile in known.values():
        if profile.fits(vendor, product):
            return profile
    return known[STANDARD]
