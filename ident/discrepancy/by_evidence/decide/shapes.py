"""Shapes of an effect beside a set: the best ones, and what integrating over them costs (Laplace)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from scipy.optimize import minimize

from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import Found, Member
from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.discrepancy.component import grid_step, inner, outer, reach
from ident.effects.family import PresentModel, Shape
from robots.arrays import FloatArray

_EVALUATIONS = 14
"""Per shape that is refined."""

_STEP = 0.02
"""Of a shape's range, for the curvature."""

_AT_LIMIT = 1e-6
"""Of that step: nearer than this a shape is at its limit."""


def refined(
    problem: Problem,
    members: Sequence[Member],
    number: int,
    found: Found,
    present: PresentModel,
    made: bool = False,
) -> Member:
    """A member of a set with the shapes of the largest evidence; κ as the set has it.

    What is one of a few is tried beside the best of all others: which axes of a foot give way is little of
    what a grid shows, on which no resonance is that of the arm.

    Args:
        problem: the data.
        members: the set.
        number: which of them.
        found: κ that it is looked at with.
        present: the model that columns are made of.
        made: whether the member's columns are of that model already.
    """
    search = _Search(problem, members, number, found.level, present)
    if made:
        search.known[members[number].entry.placed.shape] = search.value(members[number].entry)
    return search.best()


class _Search:
    def __init__(
        self,
        problem: Problem,
        members: Sequence[Member],
        number: int,
        level: Level,
        present: PresentModel,
    ) -> None:
        self.problem, self.level, self.present = problem, level, present
        self.others = [member.entry.white for k, member in enumerate(members) if k != number]
        self.member = members[number]
        self.candidate: Candidate = self.member.candidate
        self.free = [k for k, shape in enumerate(self.candidate.shapes) if not shape.fixed]
        self.around = self.member.entry.placed.shape
        self.best_entry = self.member.entry
        self.best_value = -np.inf
        self.known: dict[tuple[float, ...], float] = {}

    def value_at(self, point: FloatArray) -> float:
        """With free shapes at inner values; a simplex asks for its start again, and for bounds."""
        shape = self._shape_at(point)
        if shape not in self.known:
            self.known[shape] = self.value(self._entry(shape))
        return self.known[shape]

    def value(self, entry: Entry) -> float:
        """Log evidence of the set with the effect like this; without it where the data show nothing of it."""
        effects = (*self.others, entry.white) if entry.white.there else tuple(self.others)
        gram = Gram(self.problem.rows, effects)
        value = gram.posterior(self.level).log_evidence
        if not entry.white.there:
            return value
        if value > self.best_value:
            self.best_value, self.best_entry = value, entry
        return value

    def best(self) -> Member:
        value = self.value_at(self._point())
        if not self.free:
            return Member(self.best_entry, self.member.volume)
        limits = [(inner(s, s.lower), inner(s, s.upper)) for s in self._shapes()]
        self._simplex(limits)
        while self._another_of_few():
            self._simplex(limits)
        assert self.best_value >= value
        return Member(self.best_entry, self._volume(limits))

    def _simplex(self, limits: Sequence[tuple[float, float]]) -> None:
        """From the shapes that are known as the best on."""
        start = self._point()
        steps = np.array([grid_step(s) for s in self._shapes()])
        minimize(
            lambda point: -self.value_at(point),
            start,
            method="Nelder-Mead",
            bounds=limits,
            options={
                "maxfev": _EVALUATIONS * len(self.free),
                "initial_simplex": np.vstack([start, *_within(start, np.diag(0.4 * steps), limits)]),
                "xatol": 1e-3,
                "fatol": 0.02,
            },
        )
        self.around = self.best_entry.placed.shape

    def _another_of_few(self) -> bool:
        """Whether other values of fixed shapes are likelier; of scanned ones the data have said which."""
        grids = [
            one.grid if one.fixed and not one.scanned else (value,)
            for one, value in zip(self.candidate.shapes, self.around, strict=True)
        ]
        before = self.best_value
        for shape in product(*grids):
            self.around = shape
            self.value_at(self._point())
        self.around = self.best_entry.placed.shape
        return self.best_value > before

    def _shape_at(self, point: FloatArray) -> tuple[float, ...]:
        """All shapes, the free ones at inner values."""
        shape = list(self.around)
        for k, value in zip(self.free, point, strict=True):
            one = self.candidate.shapes[k]
            if inner(one, shape[k]) != float(value):  # there and back is not the very same
                shape[k] = float(np.clip(outer(one, value), one.lower, one.upper))
        return tuple(shape)

    def _entry(self, shape: tuple[float, ...]) -> Entry:
        placed = self.candidate.at(self.problem.prepared.robot, shape, self.present)
        return Entry(self.candidate, placed, self.problem.rows.effect(placed))

    def _shapes(self) -> list[Shape]:
        return [self.candidate.shapes[k] for k in self.free]

    def _point(self) -> FloatArray:
        """Inner values of the free shapes as they are."""
        return np.array([inner(self.candidate.shapes[k], self.around[k]) for k in self.free])

    def _volume(self, limits: Sequence[tuple[float, float]]) -> float:
        """Log of the posterior's width over that of the prior, shape by shape; fixed ones by their number.

        About a largest value within its limits that is a normal density's; at a limit, where the next shapes
        beyond it would be likelier, an exponential's on the one side that there is.
        """
        value, point = self.best_value, self._point()
        volume = 0.0
        for index, ((low, high), shape) in enumerate(zip(limits, self._shapes(), strict=True)):
            step = _STEP * reach(shape)
            drop = 0.0
            for side in (-step, step):
                tried = point.copy()
                tried[index] = np.clip(point[index] + side, low, high)
                drop += max(value - self.value_at(tried), 0.0)
            drop = max(drop, 1e-6)
            at_limit = min(point[index] - low, high - point[index]) < _AT_LIMIT * step
            width = step / drop if at_limit else np.sqrt(2.0 * np.pi) * step / np.sqrt(drop)
            volume += float(np.log(min(1.0, width / (high - low))))
        return volume - log_number(self.candidate)


def log_number(kind: Candidate) -> float:
    """Log of how many values fixed shapes have: each was as likely before any data."""
    return float(np.log([len(shape.grid) for shape in kind.shapes if shape.fixed]).sum())


def _within(start: FloatArray, steps: FloatArray, limits: Sequence[tuple[float, float]]) -> FloatArray:
    """Points some steps from the start; those that leave the bounds go to the other side."""
    low, high = np.array(limits).T
    outside = (start + steps < low) | (start + steps > high)
    return np.clip(np.where(outside, start - steps, start + steps), low, high)
