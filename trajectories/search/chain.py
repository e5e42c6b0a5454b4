"""Chains of segments through waypoints, each segment with the information that it brings."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robots.arrays import FloatArray
from trajectories.errors import PlanError
from trajectories.motions.motion import MotionState
from trajectories.motions.segments import PiecewiseJerk, SegmentPlanner, Waypoint, join
from trajectories.search.problem import ExcitationProblem

FIRST_STEP = 0.3
"""Step of a new waypoint, as a share of half the travel and of the velocity limit."""

SLOWEST_PACE = 6.0
"""Times the shortest duration that a slow pass may last."""

PACED = 0.1
"""Share of the moved waypoints whose pace changes, where slow passes are allowed."""

_SLOWDOWNS = 4
"""Tries to bring a segment down to the speed that the tool may have."""

_TOOL_SPEED_SHARE = 0.9
"""Share of the tool's speed limit that a waypoint may have."""

_SMALL_MOVE = 0.02
"""Share of half the travel: the move that shows why no motion is possible."""


@dataclass(frozen=True)
class Piece:
    """One segment with its information at 100 rows per second."""

    motion: PiecewiseJerk
    matrix: FloatArray


@dataclass
class Chain:
    """Waypoints, the pieces between them, and the step by which each waypoint is moved.

    ``whole`` is the information of the whole chain where its pieces cannot be judged one by one.
    """

    waypoints: list[Waypoint]
    pieces: list[Piece]
    steps: list[float]
    whole: FloatArray | None = None

    @property
    def duration(self) -> float:
        """s."""
        return sum(piece.motion.duration for piece in self.pieces)

    @property
    def matrix(self) -> FloatArray:
        """The information matrix: the sum over the pieces, or that of the whole."""
        if self.whole is not None:
            return self.whole
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
        return self._within_tool_speed(Waypoint(position, velocity, np.zeros(limits.n)))

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
        pace = waypoint.pace
        if self.problem.slow_passes and self.generator.random() < PACED:
            pace = float(np.clip(pace * np.exp(0.7 * self.generator.standard_normal()), 1.0, SLOWEST_PACE))
        return self._within_tool_speed(Waypoint(position, velocity, np.zeros(n), pace))

    def _within_tool_speed(self, waypoint: Waypoint) -> Waypoint:
        """The waypoint, passed slowly enough for the tool."""
        tool = self.problem.tool
        if tool is None or tool.limit is None:
            return waypoint
        position, velocity, zero = (
            waypoint.position[None],
            waypoint.velocity[None],
            waypoint.acceleration[None],
        )
        speed = float(tool.speeds(MotionState(position, velocity, zero, zero))[0])
        share = min(1.0, _TOOL_SPEED_SHARE * tool.limit / speed) if speed > 0.0 else 1.0
        return replace(waypoint, velocity=waypoint.velocity * share)

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
        return self._judged(
            Chain(
                chain.waypoints[:index] + instead + chain.waypoints[index + 1 :],
                chain.pieces[: max(index - 1, 0)] + fresh + chain.pieces[index + 1 :],
                chain.steps[:index] + steps + chain.steps[index + 1 :],
            )
        )

    def _judged(self, chain: Chain) -> Chain | None:
        """The chain, with the information of the whole where that is not the sum of its pieces."""
        if not self.problem.whole:
            return chain
        matrices = self.problem.matrices([join([piece.motion for piece in chain.pieces])])
        return None if matrices is None else replace(chain, whole=matrices[0])

    def pieces(self, waypoints: Sequence[Waypoint]) -> list[Piece] | None:
        """Segments through waypoints with their information, in one call of the regressor."""
        motions = []
        for before, after in itertools.pairwise(waypoints):
            motion = self._segment(before, after)
            if motion is None:
                return None
            motions.append(motion)
        if self.problem.whole:
            return [Piece(motion, np.empty((0, 0))) for motion in motions]
        matrices = self.problem.matrices(motions)
        if matrices is None:
            return None
        return [Piece(motion, matrix) for motion, matrix in zip(motions, matrices, strict=True)]

    def _segment(self, before: Waypoint, after: Waypoint) -> PiecewiseJerk | None:
        """The segment between two waypoints at its pace, slower where the tool may not be so fast.

        None where there is none, or none that would not take all the time that there is.
        """
        motion = self._connected(before, after, None)
        if motion is not None and after.pace > 1.0:
            motion = self._connected(before, after, motion.duration * after.pace)
        tool = self.problem.tool
        for _ in range(_SLOWDOWNS):
            share = tool.share(motion) if motion is not None and tool is not None else 0.0
            if motion is None or share <= 1.0:
                break
            motion = self._connected(before, after, motion.duration * max(share, 1.05))
        return motion

    def _connected(self, before: Waypoint, after: Waypoint, duration: float | None) -> PiecewiseJerk | None:
        if duration is not None and duration > self.problem.duration:
            return None
        motion = self._planner.connect(before, after, duration)
        return motion if motion is not None and motion.duration <= self.problem.duration else None

    def first_chain(self) -> Chain:
        """Random waypoints as long as the time lasts, closer together where it does not last for one.

        Raises:
            PlanError: when the time does not even allow a small motion.
        """
        for spread in (0.8, 0.8, 0.4, 0.2, 0.1, 0.05):
            chain = self._random_chain(spread)
            if chain is not None:
                return chain
        raise self._impossible()

    def _impossible(self) -> PlanError:
        """Why there is not even a small motion."""
        problem, limits = self.problem, self.problem.limits
        start = problem.start or Waypoint.at_rest((limits.upper + limits.lower) / 2)
        shift = _SMALL_MOVE * (limits.upper - limits.lower) / 2
        inward = np.where(start.position > (limits.upper + limits.lower) / 2, -1.0, 1.0)
        goal = Waypoint.at_rest(start.position + inward * shift)
        free, slowed = self._planner.connect(start, goal), self._segment(start, goal)
        free_fits = free is not None and 2.0 * free.duration <= problem.duration
        fits = slowed is not None and 2.0 * slowed.duration <= problem.duration
        broken = problem.complaint(slowed) if slowed is not None and fits else None
        if broken is not None:
            return PlanError.of(broken)
        if problem.tool is not None and free_fits:
            return PlanError(
                f"tool speed of {problem.tool.limit} m/s leaves no time for a motion in "
                f"{problem.duration:g} s; allowed: a higher speed or a longer duration",
                constraint="tool speed",
            )
        slowest, why = _slowest(shift, self.problem)
        return PlanError(
            f"no motion out of the start and back fits into {problem.duration:g} s, its {why} limit is in "
            "the way; allowed: a longer duration or higher limits",
            constraint="duration",
            joint=limits.names[slowest],
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
        return self._judged(Chain(waypoints, pieces + closing, [FIRST_STEP] * len(waypoints)))


def _slowest(shift: FloatArray, problem: ExcitationProblem) -> tuple[int, str]:
    """The joint that takes longest for a move (n,) from rest to rest, and which limit makes it so."""
    limits = problem.limits
    times = {
        "velocity": shift / limits.velocity,
        "acceleration": 2.0 * np.sqrt(shift / limits.acceleration),
        "jerk": np.cbrt(32.0 * shift / limits.jerk),
    }
    why = max(times, key=lambda name: float(times[name].max()))
    return int(times[why].argmax()), why
