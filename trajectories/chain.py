"""Chains of segments through waypoints, each segment with the information that it brings."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots.arrays import FloatArray
from trajectories.errors import PlanError
from trajectories.information import ROW_RATE
from trajectories.motion import MotionState, midpoints
from trajectories.problem import ExcitationProblem
from trajectories.segments import PiecewiseJerk, SegmentPlanner, Waypoint

FIRST_STEP = 0.3
"""Step of a new waypoint, as a share of half the travel and of the velocity limit."""


@dataclass(frozen=True)
class Piece:
    """One segment with its information at 100 rows per second."""

    motion: PiecewiseJerk
    matrix: FloatArray


@dataclass
class Chain:
    """Waypoints, the pieces between them, and the step by which each waypoint is moved."""

    waypoints: list[Waypoint]
    pieces: list[Piece]
    steps: list[float]

    @property
    def duration(self) -> float:
        """s."""
        return sum(piece.motion.duration for piece in self.pieces)

    @property
    def matrix(self) -> FloatArray:
        """The information matrix: the sum over the pieces."""
        total: FloatArray = np.sum([piece.matrix for piece in self.pieces], axis=0)
        return total


class ChainBuilder:
    """Makes chains that keep a problem's limits, and others from them by changing one waypoint."""

    def __init__(self, problem: ExcitationProblem, generator: np.random.Generator) -> None:
        self.problem = problem
        self.generator = generator
        self._planner = SegmentPlanner(problem.limits)

    def __getstate__(self) -> dict[str, object]:
        """ruckig's calculator stays in its process; it has no memory."""
        return {"problem": self.problem, "generator": self.generator}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._planner = SegmentPlanner(self.problem.limits)

    def random_waypoint(self, spread: float = 0.8) -> Waypoint:
        """Anywhere in the middle ``spread`` of the travel, in motion."""
        limits = self.problem.limits
        middle, half = (limits.upper + limits.lower) / 2, (limits.upper - limits.lower) / 2
        position = middle + spread * half * self.generator.uniform(-1.0, 1.0, limits.n)
        velocity = 0.7 * spread * limits.velocity * self.generator.uniform(-1.0, 1.0, limits.n)
        return Waypoint(position, velocity, np.zeros(limits.n))

    def near(self, waypoint: Waypoint, step: float, some: bool = True) -> Waypoint:
        """A waypoint a random step away, in some or in all positions and velocities."""
        limits, n = self.problem.limits, self.problem.limits.n
        shift = step * self.generator.standard_normal(2 * n)
        if some:
            which = self.generator.random(2 * n) < self.generator.choice([0.15, 0.4, 1.0])
            which[self.generator.integers(2 * n)] = True
            shift *= which
        half = (limits.upper - limits.lower) / 2
        position = np.clip(waypoint.position + shift[:n] * half, limits.lower, limits.upper)
        velocity = np.clip(waypoint.velocity + shift[n:] * limits.velocity, -limits.velocity, limits.velocity)
        return Waypoint(position, velocity, np.zeros(n))

    def with_another(self, chain: Chain, index: int) -> Chain | None:
        """The chain with one more waypoint about midway before ``index``."""
        before, after = chain.waypoints[index - 1 : index + 1]
        middle = Waypoint(
            (before.position + after.position) / 2,
            (before.velocity + after.velocity) / 2,
            np.zeros_like(before.velocity),
        )
        return self.rebuilt(chain, index, [self.near(middle, FIRST_STEP, some=False), after])

    def rebuilt(self, chain: Chain, index: int, instead: list[Waypoint]) -> Chain | None:
        """The chain with another way through ``index``: no, one or two waypoints; None if not feasible."""
        before, after = chain.waypoints[max(index - 1, 0) : index], chain.waypoints[index + 1 : index + 2]
        through = before + instead + after
        if len(through) < 2:
            return None
        fresh = self.pieces(through)
        if fresh is None:
            return None
        steps = [FIRST_STEP] * (len(instead) - 1) + [chain.steps[index]] if instead else []
        return Chain(
            chain.waypoints[:index] + instead + chain.waypoints[index + 1 :],
            chain.pieces[: max(index - 1, 0)] + fresh + chain.pieces[index + 1 :],
            chain.steps[:index] + steps + chain.steps[index + 1 :],
        )

    def pieces(self, waypoints: Sequence[Waypoint]) -> list[Piece] | None:
        """Segments through waypoints with their information, in one call of the regressor."""
        motions = []
        for before, after in itertools.pairwise(waypoints):
            motion = self._planner.connect(before, after)
            if motion is None:
                return None
            motions.append(motion)
        counts = [max(1, int(np.ceil(motion.duration * self.problem.search_rate))) for motion in motions]
        states = [m.at(midpoints(m.duration, count)) for m, count in zip(motions, counts, strict=True)]
        columns = self.problem.weighted(_stack(states))
        if columns is None:
            return None
        pieces, first = [], 0
        for motion, count in zip(motions, counts, strict=True):
            rows = columns[first : first + count].reshape(-1, columns.shape[2])
            pieces.append(Piece(motion, rows.T @ rows * (motion.duration / count * ROW_RATE)))
            first += count
        return pieces

    def first_chain(self) -> Chain:
        """Random waypoints as long as the time lasts, closer together where it does not last for one.

        Raises:
            PlanError: when the time does not even allow a small motion.
        """
        for spread in (0.8, 0.8, 0.4, 0.2, 0.1, 0.05):
            chain = self._random_chain(spread)
            if chain is not None:
                return chain
        raise PlanError(
            f"no motion out of the start and back fits into {self.problem.duration:g} s; "
            "allowed: a longer duration or higher limits",
            constraint="duration",
        )

    def _random_chain(self, spread: float) -> Chain | None:
        problem = self.problem
        waypoints = [problem.start or self.random_waypoint(spread)]
        pieces: list[Piece] = []
        closing: list[Piece] | None = None
        failures = 0
        while failures < 20:
            candidate = self.random_waypoint(spread)
            if spread < 0.4 and problem.start is not None:
                candidate = self.near(problem.start, spread / 2, some=False)
            fresh = self.pieces([waypoints[-1], candidate])
            back = self.pieces([candidate, problem.goal]) if problem.goal is not None else []
            failures += 1
            if fresh is None or back is None:
                continue
            total = sum(piece.motion.duration for piece in pieces + fresh + back)
            if total > problem.duration or not all(problem.allows(p.motion) for p in fresh + back):
                continue
            waypoints.append(candidate)
            pieces += fresh
            closing = back
            failures = 0
        if closing is None:
            return None
        if problem.goal is not None:
            waypoints.append(problem.goal)
        return Chain(waypoints, pieces + closing, [FIRST_STEP] * len(waypoints))


def _stack(states: list[MotionState]) -> MotionState:
    names = ("position", "velocity", "acceleration", "jerk")
    return MotionState(*(np.concatenate([getattr(state, name) for state in states]) for name in names))
