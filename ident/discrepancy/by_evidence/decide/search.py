"""The search over sets: forward with pairs of leaders, everything fitted again, and backward."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import TypeVar

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.decide.as_one import beside_the_others, member_of, part_of
from ident.discrepancy.by_evidence.decide.begun_again import begun_again
from ident.discrepancy.by_evidence.decide.elsewhere import Elsewhere
from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.scanned import scanned
from ident.discrepancy.by_evidence.decide.screening import Screened, screen, with_all_forms
from ident.discrepancy.by_evidence.decide.shapes import refined
from ident.discrepancy.by_evidence.decide.shapes_at_once import shapes_at_once
from ident.discrepancy.by_evidence.decide.soft_places import SoftPlaces, soft_members
from ident.discrepancy.by_evidence.decide.state import (
    Found,
    Member,
    found_set,
    has_room,
    likelier,
    stands,
    without_effects,
)
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry, library
from robots.identity_cache import IdentityCache

_log = logging.getLogger(__name__)

LEADERS = 10
"""Names at their places whose κ is fitted with them, and whose shapes are refined.

All of them: a play of 4.7 mm on a grid of 4 and 8 explains a fifth of what it does with its own size, and a
delay that needs no shape would be preferred to it.
"""

_PAIRED = 6
"""Names that are tried in pairs, each in its best form."""

_SWAPPED = 3
"""Names that are tried in the place of each member, in all their forms, beside those that pass for it, once
nothing more is found."""

MOST = 5
"""Effects of a set."""

One = TypeVar("One")

Name = tuple[str, tuple[int, ...]]
"""With its joints, from 0."""

Key = frozenset[Name]


@dataclass(frozen=True, eq=False)
class Searched:
    """Where the search ended.

    Attributes:
        found: the best set.
        empty: the model without any effect.
        present: the model with the set.
        entries: the vocabulary beside it.
        visited: log posterior of every set that was fitted.
    """

    found: Found
    empty: Found
    present: PresentWith
    entries: tuple[Entry, ...]
    visited: dict[Key, float]


@dataclass(eq=False)
class Search:
    """One search over the sets of a vocabulary."""

    problem: Problem
    wanted: Sequence[Candidate]
    progress: Callable[[str, float], None]
    visited: dict[Key, float] = field(default_factory=dict)
    _without: IdentityCache[dict[int, Found]] = field(default_factory=IdentityCache, repr=False)
    """Sets less one of their members, by number."""
    _replaced: IdentityCache[tuple[PresentWith, dict[Entry, Found]]] = field(
        default_factory=lambda: IdentityCache(MOST), repr=False
    )
    """The model of a set, and that set with candidates in the place of what it lacks."""

    @cached_property
    def elsewhere(self) -> Elsewhere:
        """Motion all over the travel."""
        return Elsewhere.of(self.problem)

    @cached_property
    def soft_places(self) -> SoftPlaces:
        """Sets in which links give way at several places."""
        return SoftPlaces(self.problem)

    def run(self) -> Searched:
        """Until no set is better."""
        problem = self.problem
        empty = without_effects(problem)
        found = self._seen(empty)
        present = present_with(problem, found)
        self.progress("vocabulary", 0.1)
        whole = library(problem.rows, self.wanted, present)
        entries, begun = self._with_scanned(whole, found, present), set[Key]()
        while True:
            self.progress("candidates", 0.2 + 0.7 * len(found.members) / MOST)
            better = self._extended(found, entries, present) if len(found.members) < MOST else None
            better = better or self._swapped(found, entries)
            if better is None and key_of(found) not in begun:
                begun.add(key_of(found))
                better = likelier(begun_again(self, found, entries, MOST), found)
            if better is None:
                break
            fitted, beside = self.settled(better)
            if fitted.log_posterior <= found.log_posterior:
                break
            found, present = fitted, beside
            entries = self._with_scanned(whole, found, present)
            _log.info("set %s, log posterior %.1f", key_of(found), found.log_posterior)
        return Searched(found, empty, present, entries, self.visited)

    def _with_scanned(
        self, entries: tuple[Entry, ...], found: Found, present: PresentWith
    ) -> tuple[Entry, ...]:
        """A vocabulary with what the residual of a set shows of periods that can be any."""
        return (*entries, *scanned(self.problem.rows, found, self.wanted, present))

    def _extended(self, found: Found, entries: Sequence[Entry], present: PresentWith) -> Found | None:
        """The best set with one or two members more; None where none is better."""
        screened = [one for one in screen(self.problem, found, entries) if has_room(found.members, one.best)]
        leaders = first_of(screened, LEADERS, [one.candidate for one in screened])
        sets = at_once(lambda one: self._shaped(self._tried(found, one.best, present), present), leaders)
        order = np.argsort([-one.log_posterior for one in sets], kind="stable")
        forms: dict[Name, Member] = {}
        for k in order:
            forms.setdefault(sets[k].members[-1].candidate.key, sets[k].members[-1])
        last = list(forms.values())
        sets += self._pairs(found, first_of(last, _PAIRED, [one.candidate for one in last]))
        sets += map(self._seen, self.soft_places.beside(found, entries, present))
        return likelier(sets, found)

    def _swapped(self, found: Found, entries: Sequence[Entry]) -> Found | None:
        """The best set with another candidate in place of one member; None where none is better.

        What came first was the likeliest without what came later.
        """
        sets = []
        for number, member in enumerate(found.members):
            without, own = self.without(found, number), member.candidate.key
            others = [
                one
                for one in screen(self.problem, without, entries)
                if one.candidate.key != own and has_room(without.members, one.best)
            ]
            sets += self.replaced(without, with_all_forms(others, _SWAPPED, member.candidate))
        return likelier(sets, found)

    def _remade(self, member: Member, present: PresentWith) -> Member:
        """A leader with columns that are made of the model with everything that is found."""
        old = member.entry
        made = member_of(self.problem, old.candidate, old.placed.shape, present, member.volume)
        return made if made.entry.white.there else member

    def _pairs(self, found: Found, leaders: Sequence[Member]) -> list[Found]:
        return [
            self._fitted(found, (one, other))
            for one, other in combinations(leaders, 2)
            if one.candidate.key != other.candidate.key and has_room((*found.members, one), other)
        ]

    def _fitted(self, found: Found, added: Sequence[Member]) -> Found:
        """A set with members more, κ of their joints fitted."""
        joints = sorted({joint for one in added for joint in one.joints})
        return self._seen(found_set(self.problem, (*found.members, *added), found.level, joints))

    def _shaped(self, found: Found, present: PresentWith) -> Found:
        """The last member with its best shapes."""
        last = len(found.members) - 1
        member = refined(self.problem, found.members, last, found, present, made=True)
        members = (*found.members[:last], member)
        shaped = found_set(self.problem, members, found.level, member.joints)
        return self._seen(max(shaped, found, key=lambda one: one.log_posterior))

    def settled(self, found: Found) -> tuple[Found, PresentWith]:
        """A set fitted again, without the members that are superfluous then."""
        return self._pruned(*self._refitted(found))

    def _refitted(self, found: Found) -> tuple[Found, PresentWith]:
        """Columns made of the model with the rest of the set, shapes one after the other, κ of all joints."""
        soft = soft_members(found)
        together = soft if len(soft) > 1 else []
        for _ in range(2):
            for number in range(len(found.members)):
                if number not in together:
                    found = beside_the_others(self.problem, found, number)
            if together:
                found = shapes_at_once(self.problem, found, together)
        found = found_set(self.problem, found.members, found.level, range(self.problem.rows.n))
        return self._seen(found), present_with(self.problem, found)

    def _pruned(self, found: Found, present: PresentWith) -> tuple[Found, PresentWith]:
        """Without the members that the others have made superfluous."""
        while found.members:
            fewer = [self.without(found, number) for number in range(len(found.members))]
            best = max(fewer, key=lambda one: one.log_posterior)
            if best.log_posterior <= found.log_posterior:
                break
            found = best
            present = present_with(self.problem, found)
        return found, present

    def without(self, found: Found, number: int) -> Found:
        """A set less one member and what is on top of it, κ of their joints fitted again."""
        made: dict[int, Found] = self._without.of(found, dict)
        if number not in made:
            rest = [member for k, member in enumerate(found.members) if k != number]
            members = [one for one in rest if stands(self.problem, one.entry, rest)]
            made[number] = self._seen(part_of(self.problem, found, members))
        return made[number]

    def replaced(self, without: Found, others: Sequence[Screened]) -> list[Found]:
        """Sets with another candidate in place of what one lacks, κ and shapes fitted.

        What was tried as a swap is asked for again when the member gets its names.
        """

        def nothing_yet() -> tuple[PresentWith, dict[Entry, Found]]:
            return present_with(self.problem, without), {}

        present, made = self._replaced.of(without, nothing_yet)
        new = [one.best for one in others if one.best.entry not in made]
        sets = at_once(lambda one: self._shaped(self._tried(without, one, present), present), new)
        best: dict[Name, int] = {}
        for k in np.argsort([-one.log_posterior for one in sets], kind="stable"):
            best.setdefault(new[k].candidate.key, int(k))
        again = at_once(lambda k: self._with_own_model(sets[k]), list(best.values()))
        for k, found in zip(best.values(), again, strict=True):
            sets[k] = found
        made.update(zip((one.entry for one in new), sets, strict=True))
        return [made[one.best.entry] for one in others]

    def _with_own_model(self, found: Found) -> Found:
        """A set whose last member has columns of the model that is fitted beside it, as settled ones have.

        The model without it has taken up what it could of it: a friction of the load beside that had 160 nats
        less than beside its own, and the name that stood in the set was sure.
        """
        fitted = beside_the_others(self.problem, found, len(found.members) - 1)
        fitted = found_set(self.problem, fitted.members, found.level, range(self.problem.rows.n))
        return self._seen(max(fitted, found, key=lambda one: one.log_posterior))

    def _tried(self, found: Found, member: Member, present: PresentWith) -> Found:
        return self._fitted(found, (self._remade(member, present),))

    def _seen(self, found: Found) -> Found:
        key = key_of(found)
        self.visited[key] = max(self.visited.get(key, -np.inf), found.log_posterior)
        return found


def first_of(ordered: Sequence[One], most: int, kinds: Sequence[Candidate]) -> list[One]:
    """So many names, each with its forms that come before the next name, and what is scanned beside them.

    Forms of one name at one place are much the same: six of a drift had left no place for the play of another
    joint, and a delay was found in its stead. What is scanned there is some of for each drive, and it takes
    no other's place.

    Args:
        ordered: the likeliest first.
        most: names at their places, not counting what is scanned.
        kinds: of each.
    """
    names: set[Name] = set()
    for k, kind in enumerate(kinds):
        if not kind.is_scanned and kind.key not in names:
            if len(names) == most:
                return list(ordered[:k])
            names.add(kind.key)
    return list(ordered)


def key_of(found: Found) -> Key:
    """Names and places of a set."""
    return frozenset(member.candidate.key for member in found.members)
