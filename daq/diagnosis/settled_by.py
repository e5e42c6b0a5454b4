"""What on the arm settles names that motion does not tell apart."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from ident.effects.vocabulary import VOCABULARY, family_named


def settled_by(effects: Iterable[str]) -> str:
    """The change on the arm that tells effects apart where no motion does.

    What tells two of them apart, else what shows that one by itself which is farthest from the motor: those
    come last in the vocabulary and are easiest to take away.

    Args:
        effects: names of the vocabulary; the same twice is one effect at two places.

    Raises:
        IdentificationError: no such name.
    """
    names = tuple(dict.fromkeys(effects))
    for one, other in combinations(names, 2):
        how = family_named(one).told_from.get(other) or family_named(other).told_from.get(one)
        if how:
            return how
    return next(family.settled_by for family in reversed(VOCABULARY) if family.name in names)
