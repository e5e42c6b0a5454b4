"""How sure each name of a set is: its place in the set is given to every candidate in turn, and to none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.decide.state import Found

NOTHING: tuple[str, tuple[int, ...]] = ("nothing", ())

_FITTED = 4
"""Other candidates whose κ is fitted with them; the rest stay as they were screened."""

HELD = 0.95
"""Probability that a reported set holds."""


@dataclass(frozen=True)
class Named:
    """One possible name at one place, joints from 0, and its probability."""

    name: str
    joints: tuple[int, ...]
    probability: float


@dataclass(frozen=True)
class Slot:
    """Names for one effect of a set, the likeliest first; nothing at all is one of them."""

    names: tuple[Named, ...]

    @property
    def held(self) -> tuple[Named, ...]:
        """The smallest set that holds 95 %."""
        return smallest(self.names)


def smallest(names: tuple[Named, ...]) -> tuple[Named, ...]:
    """The fewest of names in order that together hold 95 %."""
    total, kept = 0.0, []
    for one in names:
        kept.append(one)
        total += one.probability
        if total >= HELD:
            break
    return tuple(kept)


def slot(search: Search, searched: Searched, number: int, without: Found) -> Slot:
    """Names for one member of the set that a search ended with.

    Args:
        search: that found it.
        searched: where it ended.
        number: of the member.
        without: the set without it, fitted.
    """
    found = searched.found
    own = found.members[number].candidate.key
    odds = {NOTHING: 0.0, own: found.log_posterior - without.log_posterior}
    others = [one for one in screen(search.problem, without, searched.entries) if one.candidate.key != own]
    for rank, one in enumerate(others):
        value = one.log_odds
        if rank < _FITTED:
            replaced = search.replaced(without, one).log_posterior
            value = max(value, replaced - without.log_posterior)
        odds[one.candidate.key] = max(odds.get(one.candidate.key, -np.inf), value)
    return Slot(probabilities(odds))


def probabilities(odds: dict[tuple[str, tuple[int, ...]], float]) -> tuple[Named, ...]:
    """Names in the order of their log odds, which become probabilities."""
    keys = sorted(odds, key=lambda key: -odds[key])
    values = np.array([odds[key] for key in keys])
    weights = np.exp(values - values.max())
    weights /= weights.sum()
    return tuple(Named(*key, float(weight)) for key, weight in zip(keys, weights, strict=True))


def of_nothing(search: Search, searched: Searched) -> tuple[Named, ...]:
    """Names for a first effect of an arm, nothing among them."""
    odds = {NOTHING: 0.0}
    for one in screen(search.problem, searched.empty, searched.entries):
        key = one.candidate.key
        visited = search.visited.get(frozenset([key]), -np.inf) - searched.empty.log_posterior
        odds[key] = max(odds.get(key, -np.inf), one.log_odds, visited)
    return probabilities(odds)
