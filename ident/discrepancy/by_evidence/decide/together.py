"""Two places at which links give way, fitted together: they swing as one.

A gear that is fitted alone takes a resonance that both make for its own (7.3 Hz, one of 9 beside one of 11),
and beside it the other shows little, whatever its shapes. So one place more is looked for with both of them
on a grid, as one effect that makes what both do.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.optimize import minimize

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.shapes import refined
from ident.discrepancy.by_evidence.decide.state import Found, Member, found_set
from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.discrepancy.component import inner, outer
from ident.effects.giving_way import torque_of_giving_way
from ident.effects.placed import Placed
from ident.effects.state import State
from robots.arrays import FloatArray

_FINEST = 10
"""Values of a shape on the grid of two effects, at most."""
_EVALUATIONS = 25
"""Per shape that is fitted, in each round."""
_ROUNDS = ((0.08, 0.12), (0.04, 0.06), (0.02, 0.03), (0.01, 0.015), (None, 0.1), (None, 0.02))
"""Ratios to critical with which how soft both are is fitted, then all shapes, and the first step of each simplex
in logarithms, or of a shape's range. What is damped by a hundredth shows within a hundredth of its resonance,
so it is come to from what is damped more. The misfit is fitted between them: where a place is missing it is
large, and hardly tells shapes apart."""
_LAST = _ROUNDS[-2:]
"""Of a set that has both."""
_SHARES = (1.0, 0.3, 0.1, 0.03)
"""Of the misfit of a set, that shapes are tried with."""
_FITTED = 3
"""Candidates that are, the likeliest of their grids."""

Shapes = tuple[tuple[float, ...], tuple[float, ...]]
"""Of the member and of the candidate."""


def swinging_beside(problem: Problem, found: Found, entries: Sequence[Entry]) -> list[Found]:
    """A set with one place more at which links swing with those of a member, shapes of both fitted.

    Args:
        problem: the data.
        found: the set.
        entries: the vocabulary; places with straight springs are tried, the likeliest of a grid are fitted.
    """
    giving = {k: one.candidate.place for k, one in enumerate(found.members) if _gives_way(one.entry)}
    if not giving:
        return []
    kinds = dict.fromkeys(one.candidate for one in entries if _gives_way(one) and _straight(one))
    asked = [
        _Both(problem, found, k, one) for k in giving for one in kinds if one.place not in giving.values()
    ]
    begun = at_once(_Both.begun, asked)
    order = sorted(range(len(asked)), key=lambda k: -begun[k][0])[:_FITTED]
    return at_once(lambda k: asked[k].fitted(begun[k][1]), order)


def swinging_as_one(problem: Problem, found: Found) -> Found:
    """A set whose last two members that give way are fitted together, if it is likelier so."""
    *_, first, last = [-1, -1, *(k for k, one in enumerate(found.members) if _gives_way(one.entry))]
    if first < 0:
        return found
    more = found.members[last]
    rest = [one for k, one in enumerate(found.members) if k != last]
    less = found_set(problem, rest, found.level, ())
    shapes = found.members[first].entry.placed.shape, more.entry.placed.shape
    fitted = _Both(problem, less, first, more.candidate).fitted(shapes, _LAST)
    return max(fitted, found, key=lambda one: one.log_posterior)


def _smaller(level: Level, accepted: FloatArray) -> Iterator[Level]:
    """Levels with ever less misfit, none below the accepted one, as shapes that are nearer would leave it.

    At the misfit of a set that lacks a place all shapes that leave less than that are as good.
    """
    least = np.minimum(level.kappa, accepted)
    for share in _SHARES:
        yield Level(np.maximum(share * level.kappa, least), np.maximum(share * level.excess, 1.0))


def _damped(kind: Candidate, shape: tuple[float, ...], ratio: float) -> tuple[float, ...]:
    both = zip(kind.shapes, shape, strict=True)
    return tuple(ratio if one.name == "damping_ratio" else value for one, value in both)


def _gives_way(entry: Entry) -> bool:
    return bool(entry.placed.gives_way)


def _straight(entry: Entry) -> bool:
    return all(place.gear.is_linear for place in entry.placed.gives_way)


@dataclass(eq=False)
class _Both:
    """Two effects as one.

    Attributes:
        problem: the data.
        found: a set.
        number: the one that is in it.
        candidate: the other.
    """

    problem: Problem
    found: Found
    number: int
    candidate: Candidate

    @cached_property
    def present(self) -> PresentWith:
        """With links as they were known before: without a place they have taken up what they can of it."""
        seen = present_with(self.problem, self.found, but=self.number)
        return PresentWith(self.problem.present, seen.beside, seen.apart, seen.places, seen.own)

    @property
    def kinds(self) -> tuple[Candidate, Candidate]:
        return self.found.members[self.number].candidate, self.candidate

    @property
    def others(self) -> list[Member]:
        return [one for k, one in enumerate(self.found.members) if k != self.number]

    def begun(self) -> tuple[float, Shapes]:
        """The best of a grid: log evidence, and the shapes of both."""
        values = ((self._value(shapes, self.found.level), shapes) for shapes in self._grid())
        return max(values, key=lambda one: one[0])

    def fitted(self, shapes: Shapes, rounds: Sequence[tuple[float | None, float]] = _ROUNDS) -> Found:
        """The set with both from such shapes on, the candidate last."""
        level = self.found.level
        for damping, step in rounds:
            shapes = self._simplex(shapes, level, step, damping)
            placed = self._as_one(shapes)
            entry = Entry(self.candidate, placed, self.problem.rows.effect(placed))
            found = found_set(
                self.problem, (*self.others, Member(entry, 0.0)), level, range(self.problem.rows.n)
            )
            # Of links that have not taken up what they could of a place that the set lacked.
            level, self.present = found.level, present_with(self.problem, found, but=len(self.others))
        own, new = (
            Member(Entry(kind, placed, self.problem.rows.effect(placed)), 0.0)
            for kind, placed in ((k, self._placed(k, s)) for k, s in zip(self.kinds, shapes, strict=True))
        )
        members = (*self.found.members[: self.number], own, *self.found.members[self.number + 1 :], new)
        for k in (len(members) - 1, self.number):  # of a model that has the other
            found = found_set(self.problem, members, level, range(self.problem.rows.n))
            present = present_with(self.problem, found, but=k)
            member = refined(self.problem, members, k, found, present)
            members, level = (*members[:k], member, *members[k + 1 :]), found.level
            present.forget()
        return found_set(self.problem, members, level, range(self.problem.rows.n))

    def _placed(self, kind: Candidate, shape: Sequence[float]) -> Placed:
        placed = kind.at(self.problem.prepared.robot, tuple(shape), self.present)
        assert isinstance(placed, Placed)
        return placed

    def _simplex(self, shapes: Shapes, level: Level, step: float, damping: float | None) -> Shapes:
        """Shapes of more evidence; with a damping all others but that."""
        if damping is not None:
            shapes = _damped(self.kinds[0], shapes[0], damping), _damped(self.kinds[1], shapes[1], damping)
        free = [
            (which, k, shape)
            for which, kind in enumerate(self.kinds)
            for k, shape in enumerate(kind.shapes)
            if not shape.fixed and (damping is None or shape.name != "damping_ratio")
        ]

        def at(point: FloatArray) -> Shapes:
            made = [list(one) for one in shapes]
            for (which, k, shape), x in zip(free, point, strict=True):
                made[which][k] = float(np.clip(outer(shape, x), shape.lower, shape.upper))
            return tuple(made[0]), tuple(made[1])

        start = np.array([inner(shape, shapes[which][k]) for which, k, shape in free])
        steps = [step * (1.0 if s.logarithmic else s.upper - s.lower) for *_, s in free]
        found = minimize(
            lambda point: -self._value(at(point), level),
            start,
            method="Nelder-Mead",
            options={
                "maxfev": _EVALUATIONS * len(free),
                "initial_simplex": np.vstack([start, start + np.diag(steps)]),
                "xatol": 1e-3,
                "fatol": 0.02,
            },
        )
        return at(found.x)

    def _grid(self) -> Iterator[Shapes]:
        """Of both: damped as grids are, since what hardly is shows nothing beside its own resonance."""
        own, other = (
            [shape.grid[:: -(-len(shape.grid) // _FINEST)] for shape in kind.shapes] for kind in self.kinds
        )
        yield from product(product(*own), product(*other))

    def _as_one(self, shapes: Shapes) -> Placed:
        """What both make at once, as one effect."""
        own, other = (self._placed(kind, shape) for kind, shape in zip(self.kinds, shapes, strict=True))
        places, present = (*own.gives_way, *other.gives_way), self.present

        def law(state: State) -> FloatArray:
            return torque_of_giving_way(places, present, state)[:, :, np.newaxis]

        return replace(other, law=law, gives_way=places)

    def _value(self, shapes: Shapes, level: Level) -> float:
        """Log evidence with both in the place of the member."""
        white = self.problem.rows.effect(self._as_one(shapes))
        if not white.there:
            return -np.inf
        gram = Gram(self.problem.rows, (*(one.entry.white for one in self.others), white))
        misfit = self.problem.misfit
        return max(
            gram.posterior(one).log_evidence + misfit.log_prior(one)
            for one in _smaller(level, misfit.accepted)
        )
