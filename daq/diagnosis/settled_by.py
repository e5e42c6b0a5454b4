"""What settles a name that motion alone cannot: the one thing to change on the arm."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

from daq.diagnosis.scored_families import scored_family
from ident.effects.gain_drift import UNNAMED_FAMILIES
from ident.effects.vocabulary import VOCABULARY


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
