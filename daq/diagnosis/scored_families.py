"""Every family that a search scores: the vocabulary, and the unnamed families that it describes with."""

from __future__ import annotations

from ident.effects.gain_drift import UNNAMED_FAMILIES
from ident.effects.placed import Family
from ident.effects.vocabulary import family_named


def scored_family(name: str) -> Family:
    """The family of a candidate, which may also be an unnamed one.

    Raises:
        IdentificationError: no such name.
    """
    return next((family for family in UNNAMED_FAMILIES if family.name == name), None) or family_named(name)
