"""How sure each name of a set is: its place is given to every candidate in turn, to none, and to no name.

Two motions decide, that of the rows which were fitted and that of recordings which were not.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Protocol

import numpy as np

from ident.discrepancy.by_evidence.decide.free_law import free_law
from ident.discrepancy.by_evidence.decide.no_name import (
    NO_NAME,
    form_error,
    left_beside,
    odds_beforehand,
    odds_of_no_name,
    price_of_parameters,
)
from ident.discrepancy.by_evidence.decide.screening import Screened, screen, with_all_forms
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE, Found
from ident.discrepancy.confirmation import Shown
from ident.effects.family import PlacedEffect
from ident.effects.vocabulary import family_named

Key = tuple[str, tuple[int, ...]]
"""A name and its joints, from 0."""

NOTHING: Key = ("nothing", ())

_NONE: Mapping[Key, PlacedEffect] = MappingProxyType({})

_FITTED = 4
"""Other names whose κ is fitted with them, in all their forms, beside those that pass for it; the rest stay
as they were screened."""

HELD = 0.95
"""Probability that a reported set holds."""

SURE = 0.9
"""Probability from which on a name is given, or an arm called clean."""


class OtherMotion(Protocol):
    """Recordings that nothing was fitted to (:mod:`ident.discrepancy.by_evidence.confirm.held_out`)."""

    def shown(self, found: Found, other: Found) -> Shown:
        """Of what a set predicts otherwise than another one, how much is there."""

    def alone(self, found: Found, number: int) -> Shown:
        """Of a member's own torque, all else as it is in the set, how much is there."""


@dataclass(frozen=True)
class Named:
    """One possible name at one place, joints from 0, and its probability.

    Attributes:
        placed: the effect with its likeliest shape; None for nothing.
        log_odds: against nothing, coarsened, with its prior.
        forms: that it stands for and that are likelier than itself; they are in its probability.
    """

    name: str
    joints: tuple[int, ...]
    probability: float
    placed: PlacedEffect | None = field(default=None, repr=False, compare=False)
    log_odds: float = 0.0
    forms: tuple[Named, ...] = field(default=(), repr=False, compare=False)

    @property
    def key(self) -> Key:
        return self.name, self.joints

    @property
    def own_probability(self) -> float:
        """Less that of forms that are likelier than itself."""
        return self.probability - sum(one.probability for one in self.forms)


@dataclass(frozen=True)
class Slot:
    """Names for one effect of a set, the likeliest first; nothing at all is one of them."""

    names: tuple[Named, ...]

    def probability(self, key: Key) -> float:
        """Of a name in this place."""
        return sum(one.probability for one in self.names if one.key == key)

    def log_odds(self, key: Key) -> float:
        """Of a name against nothing, coarsened, with its prior."""
        return next((one.log_odds for one in self.names if one.key == key), 0.0)

    @property
    def each(self) -> Slot:
        """With forms that a name stands for, and that are likelier than itself, as names of their own."""
        every = (
            one
            for whole in self.names
            for one in (replace(whole, probability=whole.own_probability, forms=()), *whole.forms)
        )
        return Slot(tuple(sorted(every, key=lambda one: -one.probability)))

    @property
    def named(self) -> float:
        """Probability that there is an effect in this place, and that it has a name."""
        return sum(one.probability for one in self.names if one.placed is not None)

    @property
    def something(self) -> float:
        """Probability that there is any effect in this place."""
        return 1.0 - sum(one.probability for one in self.names if one.key == NOTHING)

    @property
    def held(self) -> tuple[Named, ...]:
        """The smallest set that holds 95 %."""
        return smallest(self.names)


def smallest(names: tuple[Named, ...]) -> tuple[Named, ...]:
    """The fewest of names in order that together hold 95 %."""
    totals = np.cumsum([one.probability for one in names])
    return names[: int(np.searchsorted(totals, HELD)) + 1]


def slot(search: Search, searched: Searched, number: int, without: Found, held: OtherMotion) -> Slot:
    """Names for one member of the set that a search ended with, by both motions.

    Its own name is asked again as the others are. Shapes of a member are always refined, at the price of the
    width that is left to them; of another candidate the best of its grid counts where that is likelier.

    Args:
        search: that found it.
        searched: where it ended.
        number: of the member.
        without: the set without it, fitted.
        held: recordings that were not fitted.
    """
    found = searched.found
    own = found.members[number].candidate.key
    seen = held.shown(found, without)
    elsewhere = TEMPERATURE * seen.nats
    odds = {NOTHING: 0.0, own: found.log_posterior - without.log_posterior + elsewhere}
    forms = {own: found.members[number].entry.placed}
    candidates = screen(search.problem, without, searched.entries)
    again = next((one for one in candidates if one.candidate.key == own), None)
    if again is not None:
        (fitted,) = search.replaced(without, [again])
        odds[own] = max(odds[own], fitted.log_posterior - without.log_posterior + elsewhere)
    others = [one for one in candidates if one.candidate.key != own]
    asked = with_all_forms(others, _FITTED, found.members[number].candidate)
    replaced = dict(zip(map(id, asked), search.replaced(without, asked), strict=True))
    for one in others:
        value = one.log_odds + elsewhere
        other = replaced.get(id(one))
        if other is not None:
            value = max(value, other.log_posterior - without.log_posterior + elsewhere)
            value -= TEMPERATURE * held.shown(found, other).nats
        odds[one.candidate.key] = max(odds.get(one.candidate.key, -np.inf), value)
        forms.setdefault(one.candidate.key, one.best.entry.placed)
    precision = search.problem.rows.known.precision[: search.problem.beta.count]
    price = price_of_parameters(precision, without.posterior, found.posterior)
    member, left = found.members[number], left_beside(search.problem, found, number)
    possible = search.problem.friction.log_possible(found.members, found.posterior, own[1])
    alone, form = held.alone(found, number), form_error(member.candidate.family.rough, member.is_friction)
    outside = odds_beforehand(search.problem, found, number)
    unknown = odds_of_no_name(alone, seen, price, possible, left, form, outside)
    unknown = max(unknown, free_law(search.problem, searched, number))
    odds[NO_NAME, own[1]] = odds[own] + unknown
    listed = probabilities(odds, forms)
    return Slot(as_limit(listed, own, *_forms(search, found, without, listed, own, candidates)))


def _forms(
    search: Search,
    found: Found,
    without: Found,
    listed: Sequence[Named],
    own: Key,
    candidates: Sequence[Screened],
) -> tuple[list[Key], list[Key]]:
    """Likely forms of a name that say something else all over the travel, and those that add nothing."""
    shown = next(one.probability for one in listed if one.key == own)
    apart, none_more = [], []
    for one in listed:
        if one.joints == own[1] and own[0] in _contained(one.name) and one.probability > 1.0 - HELD:
            form = with_name(search, without, candidates, one.key)
            if not search.elsewhere.adds(form, found):
                none_more.append(one.key)
            elif one.probability <= shown and not search.elsewhere.same(form, found):
                apart.append(one.key)
    return apart, none_more


def with_name(search: Search, without: Found, candidates: Sequence[Screened], key: Key) -> Found:
    """A set with the likeliest form of a name in the place of what it lacks."""
    forms = search.replaced(without, [one for one in candidates if one.candidate.key == key])
    return max(forms, key=lambda found: found.log_posterior)


def as_limit(
    names: tuple[Named, ...],
    shown: Key | None = None,
    apart: Collection[Key] = (),
    none_more: Collection[Key] = (),
) -> tuple[Named, ...]:
    """Names of which the one that is shown stands for every form that contains it at its place.

    Friction that falls with speed holds Coulomb friction and something more: where these data show Coulomb
    friction and are even about the rest, it is what they show. What is shown has the probability of all that
    it stands for; what of it is likelier than itself stays beside it, as what it cannot be told from.

    Args:
        names: the likeliest first.
        shown: key of the name that is shown; the likeliest where it is not said.
        apart: forms that are names of their own, since they say something else of other motion.
        none_more: forms that have no more than what is shown.
    """
    first = next(one for one in names if one.key == shown or (shown is None and one.name != NO_NAME))
    if first.key == NOTHING:
        return names
    more = tuple(
        one
        for one in names
        if one.joints == first.joints and first.name in _contained(one.name) and one.key not in apart
    )
    total = first.probability + sum(one.probability for one in more)
    rivals = (one for one in more if one.log_odds > first.log_odds and one.key not in none_more)
    whole = replace(first, probability=total, forms=tuple(rivals))
    kept = [whole if one is first else one for one in names if one not in more]
    return tuple(sorted(kept, key=lambda one: -one.probability))


def _contained(name: str) -> tuple[str, ...]:
    """Limits of a name; what has no name has none."""
    return () if name in (NOTHING[0], NO_NAME) else family_named(name).contains


def probabilities(odds: Mapping[Key, float], forms: Mapping[Key, PlacedEffect] = _NONE) -> tuple[Named, ...]:
    """Names in the order of their log odds, which become probabilities.

    Args:
        odds: log odds of each against nothing.
        forms: each with its likeliest shape, where known.
    """
    keys = sorted(odds, key=lambda key: -odds[key])
    values = np.array([odds[key] for key in keys])
    weights = np.exp(values - values.max())
    weights /= weights.sum()
    return tuple(
        Named(*key, float(weight), forms.get(key), odds[key])
        for key, weight in zip(keys, weights, strict=True)
    )


def with_nats(names: Sequence[Named], more: Mapping[Key, float]) -> tuple[Named, ...]:
    """Names of which some have so many nats more, by what else was looked at; the likeliest first.

    Args:
        names: the likeliest first; one that stands for others has their probability.
        more: nats, coarsened; none for names that were not asked.
    """
    first, added = names[0], np.array([more.get(one.key, 0.0) for one in names])
    values = np.array(
        [np.log(one.probability) if one.probability > 0.0 else one.log_odds - first.log_odds for one in names]
    )
    weights = np.exp(values + added - (values + added).max())
    found = [
        replace(one, probability=float(weight), log_odds=one.log_odds + float(nats))
        for one, weight, nats in zip(names, weights / weights.sum(), added, strict=True)
    ]
    return tuple(sorted(found, key=lambda one: -one.probability))


def of_nothing(search: Search, searched: Searched) -> tuple[Named, ...]:
    """Names for a first effect of an arm, nothing among them."""
    odds = {NOTHING: 0.0}
    forms: dict[Key, PlacedEffect] = {}
    for one in screen(search.problem, searched.empty, searched.entries):
        key = one.candidate.key
        visited = search.visited.get(frozenset([key]), -np.inf) - searched.empty.log_posterior
        odds[key] = max(odds.get(key, -np.inf), one.log_odds, visited)
        forms.setdefault(key, one.best.entry.placed)
    return probabilities(odds, forms)
