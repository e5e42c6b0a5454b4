"""Search for the waypoints of the most informative motion: one waypoint is changed at a time.

The information of a motion is the sum over its segments, and a waypoint touches two of them. So a trial
costs two segments and not a whole motion: the exchange idea of optimal design (Fedorov 1972), accepted by
simulated annealing (Kirkpatrick et al. 1983). Trials are counted, not timed, so a seed repeats exactly.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from robots.arrays import FloatArray
from trajectories.errors import PlanError
from trajectories.information import NONE, ROW_RATE, Objective
from trajectories.limits import Limits
from trajectories.motion import MotionState, midpoints
from trajectories.segments import PiecewiseJerk, SegmentPlanner, Waypoint

Regressor = Callable[[MotionState], FloatArray]
"""The base regressor: samples × joints × b of the states of a motion."""

Check = Callable[[PiecewiseJerk], bool]
"""Whether a segment may be driven; called only on segments that would be an improvement."""

SEARCH_ROW_RATE = 50.0
START_TEMPERATURE = 0.005
FIRST_STEP, SMALLEST_STEP, LARGEST_STEP = 0.3, 0.005, 1.0
OVERTIME_COST = 5.0
"""Score per relative excess of the duration: more than the information that the time could bring."""


@dataclass(frozen=True)
class ExcitationProblem:
    """What a motion is to achieve and to keep.

    Attributes:
        regressor: base regressor of the arm.
        sigma: torque noise per joint (n,), the weights.
        prior: base parameters (b,) for a first look at the torque, compared with ``limits.torque``.
        limits: of the arm.
        duration: longest motion, s.
        start, goal: fixed ends; None for an end that may be anywhere, in motion.
        objective: what is minimised.
        checks: further conditions on each segment, the dear ones last.
    """

    regressor: Regressor
    sigma: FloatArray
    prior: FloatArray
    limits: Limits
    duration: float
    start: Waypoint | None
    goal: Waypoint | None
    objective: Objective
    checks: tuple[Check, ...] = ()


@dataclass(frozen=True)
class _Piece:
    """One segment with its information."""

    motion: PiecewiseJerk
    matrix: FloatArray


@dataclass
class _Chain:
    waypoints: list[Waypoint]
    pieces: list[_Piece]
    steps: list[float]

    @property
    def duration(self) -> float:
        return sum(piece.motion.duration for piece in self.pieces)


@dataclass
class WaypointSearch:
    """One annealed search from one seed. :meth:`advance` it as far as time allows; ``best`` is always valid.

    Attributes:
        problem: what is sought.
        seed: fixes every trial.
        evaluations: trials that the cooling is spread over.
        done: trials so far.
        best_score: of the best motion that keeps the duration.
    """

    problem: ExcitationProblem
    seed: int
    evaluations: int
    done: int = 0
    best_score: float = NONE
    _generator: np.random.Generator = field(init=False, repr=False)
    _chain: _Chain = field(init=False, repr=False)
    _best: _Chain = field(init=False, repr=False)
    _score: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._generator = np.random.default_rng(self.seed)
        self._planner = SegmentPlanner(self.problem.limits)
        self._chain = self._first_chain()
        self._score = self._score_of(self._chain, NONE)
        self._best, self.best_score = self._chain, self._score

    def __getstate__(self) -> dict[str, object]:
        """ruckig's calculator stays in its process; it has no memory."""
        return {name: value for name, value in self.__dict__.items() if name != "_planner"}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._planner = SegmentPlanner(self.problem.limits)

    @property
    def best_segments(self) -> list[PiecewiseJerk]:
        """The best motion so far, segment by segment."""
        return [piece.motion for piece in self._best.pieces]

    @property
    def best_waypoints(self) -> list[Waypoint]:
        """Where the best motion's segments begin and end."""
        return list(self._best.waypoints)

    def advance(self, trials: int) -> None:
        """Do some more trials, as many as are left of ``evaluations`` at most."""
        for _ in range(min(trials, self.evaluations - self.done)):
            self._trial()
            self.done += 1

    def _trial(self) -> None:
        cooling = max(0.0, 1.0 - self.done / (0.8 * self.evaluations))
        worst = self._score - START_TEMPERATURE * cooling**2 * float(np.log(self._generator.random()))
        index = int(self._generator.integers(len(self._chain.waypoints)))
        kind = self._generator.random()
        inside = 0 < index < len(self._chain.waypoints) - 1
        if inside and kind < 0.04:
            candidate = self._with_another(index)
        elif inside and kind < 0.06:
            candidate = self._rebuilt(index, [])
        elif not self._is_fixed(index):
            candidate = self._rebuilt(index, [self._moved(index, anywhere=kind > 0.96)])
        else:
            candidate = None
        accepted = candidate is not None and self._accept(candidate, worst)
        if 0.06 <= kind <= 0.96 and len(self._chain.steps) > index:
            factor = 1.6 if accepted else 0.95
            step = self._chain.steps[index] * factor
            self._chain.steps[index] = min(max(step, SMALLEST_STEP), LARGEST_STEP)

    def _accept(self, candidate: _Chain, worst: float) -> bool:
        score = self._score_of(candidate, worst)
        if score > worst:
            return False
        known = {id(piece) for piece in self._chain.pieces}
        fresh = [piece for piece in candidate.pieces if id(piece) not in known]
        if not all(check(piece.motion) for check in self.problem.checks for piece in fresh):
            return False
        self._chain, self._score = candidate, score
        if score < self.best_score and candidate.duration <= self.problem.duration:
            self.best_score = score
            self._best = _Chain(list(candidate.waypoints), list(candidate.pieces), [])
        return True

    def _score_of(self, chain: _Chain, unless_above: float) -> float:
        overtime = OVERTIME_COST * max(0.0, chain.duration / self.problem.duration - 1.0)
        return self.problem.objective.score(sum_of(chain.pieces), unless_above - overtime) + overtime

    def _is_fixed(self, index: int) -> bool:
        if index == 0:
            return self.problem.start is not None
        return index == len(self._chain.waypoints) - 1 and self.problem.goal is not None

    def _moved(self, index: int, *, anywhere: bool) -> Waypoint:
        if anywhere:
            return self._random_waypoint(0.8)
        n = self.problem.limits.n
        which = self._generator.random(2 * n) < self._generator.choice([0.15, 0.4, 1.0])
        which[self._generator.integers(2 * n)] = True
        shift = which * self._generator.standard_normal(2 * n) * self._chain.steps[index]
        return self._shifted(self._chain.waypoints[index], shift)

    def _with_another(self, index: int) -> _Chain | None:
        """The chain with one more waypoint about midway before ``index``."""
        before, after = self._chain.waypoints[index - 1 : index + 1]
        middle = Waypoint(
            (before.position + after.position) / 2,
            (before.velocity + after.velocity) / 2,
            np.zeros_like(before.velocity),
        )
        shift = FIRST_STEP * self._generator.standard_normal(2 * self.problem.limits.n)
        return self._rebuilt(index, [self._shifted(middle, shift), after])

    def _shifted(self, waypoint: Waypoint, shift: FloatArray) -> Waypoint:
        limits, n = self.problem.limits, self.problem.limits.n
        half = (limits.upper - limits.lower) / 2
        position = np.clip(waypoint.position + shift[:n] * half, limits.lower, limits.upper)
        velocity = np.clip(waypoint.velocity + shift[n:] * limits.velocity, -limits.velocity, limits.velocity)
        return Waypoint(position, velocity, np.zeros(n))

    def _random_waypoint(self, spread: float) -> Waypoint:
        limits = self.problem.limits
        middle, half = (limits.upper + limits.lower) / 2, (limits.upper - limits.lower) / 2
        position = middle + spread * half * self._generator.uniform(-1.0, 1.0, limits.n)
        velocity = 0.7 * min(1.0, spread) * limits.velocity * self._generator.uniform(-1.0, 1.0, limits.n)
        return Waypoint(position, velocity, np.zeros(limits.n))

    def _rebuilt(self, index: int, instead: list[Waypoint]) -> _Chain | None:
        """The chain with another way through ``index``: no, one or two waypoints; None if not feasible."""
        chain = self._chain
        before, after = chain.waypoints[max(index - 1, 0) : index], chain.waypoints[index + 1 : index + 2]
        through = before + instead + after
        if len(through) < 2:
            return None
        fresh = self._pieces(through)
        if fresh is None:
            return None
        first, last = max(index - 1, 0), index + 1
        return _Chain(
            chain.waypoints[:index] + instead + chain.waypoints[index + 1 :],
            chain.pieces[:first] + fresh + chain.pieces[last:],
            chain.steps[:index] + _steps(chain.steps[index], len(instead)) + chain.steps[index + 1 :],
        )

    def _pieces(self, waypoints: list[Waypoint]) -> list[_Piece] | None:
        """Segments through waypoints with their information, in one call of the regressor."""
        motions = []
        for before, after in itertools.pairwise(waypoints):
            motion = self._planner.connect(before, after)
            if motion is None:
                return None
            motions.append(motion)
        return self._with_information(motions)

    def _with_information(self, motions: list[PiecewiseJerk]) -> list[_Piece] | None:
        problem = self.problem
        counts = [max(1, int(np.ceil(m.duration * SEARCH_ROW_RATE))) for m in motions]
        states = [m.at(midpoints(m.duration, k)) for m, k in zip(motions, counts, strict=True)]
        columns = problem.regressor(_stack(states))
        if (np.abs(columns @ problem.prior) > problem.limits.torque).any():
            return None
        columns /= problem.sigma[:, np.newaxis]
        pieces, first = [], 0
        for motion, count in zip(motions, counts, strict=True):
            rows = columns[first : first + count].reshape(-1, columns.shape[2])
            weight = motion.duration / count * ROW_RATE
            pieces.append(_Piece(motion, rows.T @ rows * weight))
            first += count
        return pieces

    def _first_chain(self) -> _Chain:
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
            "allowed: a longer duration, or higher limits",
            constraint="duration",
        )

    def _random_chain(self, spread: float) -> _Chain | None:
        problem = self.problem
        waypoints = [problem.start or self._random_waypoint(spread)]
        pieces: list[_Piece] = []
        closing: list[_Piece] | None = None
        failures = 0
        while failures < 20:
            candidate = self._random_waypoint(spread)
            if spread < 0.4 and problem.start is not None:
                candidate = self._near(problem.start, candidate, spread)
            fresh = self._pieces([waypoints[-1], candidate])
            back = self._pieces([candidate, problem.goal]) if problem.goal is not None else []
            if fresh is None or back is None or not self._allowed(fresh + back):
                failures += 1
                continue
            total = sum(piece.motion.duration for piece in pieces + fresh + back)
            if total > problem.duration:
                failures += 1
                continue
            waypoints.append(candidate)
            pieces += fresh
            closing = back
            failures = 0
        if closing is None:
            return None
        if problem.goal is not None:
            waypoints.append(problem.goal)
        return _Chain(waypoints, pieces + closing, [FIRST_STEP] * len(waypoints))

    def _near(self, start: Waypoint, candidate: Waypoint, spread: float) -> Waypoint:
        limits = self.problem.limits
        shift = candidate.position - (limits.upper + limits.lower) / 2
        position = np.clip(start.position + shift, limits.lower, limits.upper)
        return Waypoint(position, candidate.velocity * spread, candidate.acceleration)

    def _allowed(self, pieces: list[_Piece]) -> bool:
        return all(check(piece.motion) for check in self.problem.checks for piece in pieces)


def _steps(step: float, count: int) -> list[float]:
    return [FIRST_STEP] * (count - 1) + [step] if count else []


def sum_of(pieces: list[_Piece]) -> FloatArray:
    """The information matrix of a chain."""
    total: FloatArray = np.sum([piece.matrix for piece in pieces], axis=0)
    return total


def _stack(states: list[MotionState]) -> MotionState:
    names = ("position", "velocity", "acceleration", "jerk")
    return MotionState(*(np.concatenate([getattr(state, name) for state in states]) for name in names))
