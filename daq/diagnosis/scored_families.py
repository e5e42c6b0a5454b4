"""What the vocabulary says of a candidate that a search scores, and what settles names that motion cannot."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from ident.effects.gain_drift import UNNAMED_FAMILIES
from ident.effects.placed import Family
from ident.effects.vocabulary import VOCABULARY, family_named


def scored_family(name: str) -> Family:
    """The family of a candidate, which may also be an unnamed one.

    Raises:
        IdentificationError: no such name.
    """
    return next((family for family in UNNAMED_FAMILIES if family.name == name), None) or family_named(name)


def settled_by(effects: Iterable[str]) -> str:
    """The change on the arm that tells effects apart where no motion does.

    What tells two of them apart, else what shows that one by itself which is farthest from the motor: those
    come last in the vocabulary and are easiest to take away.

    Args:
        effects: names of the vocabulary; the same twice is one effect at two places.
    """
    names = tuple(dict.fromkeys(effects))
    for one, other in combinations(names, 2):
        how = scored_family(one).told_from.get(other) or scored_family(other).told_from.get(one)
        if how:
            return how
    return next(
        family.settled_by for family in (*reversed(VOCABULARY), *UNNAMED_FAMILIES) if family.name in names
    )
