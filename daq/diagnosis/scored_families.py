"""Every family that a search scores: the vocabulary, and the forms without a name that it describes with."""

from __future__ import annotations

from ident.effects.gain_drift import WITHOUT_A_NAME
from ident.effects.placed import Family
from ident.effects.vocabulary import family_named


def scored_family(name: str) -> Family:
    """The family of a candidate, which may also be a form that no finding is ever called by.

    Raises:
        IdentificationError: no such name.
    """
    return next((family for family in WITHOUT_A_NAME if family.name == name), None) or family_named(name)
