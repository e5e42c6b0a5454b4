"""Search for the Fourier coefficients of the most informative periodic motion, by CMA-ES (Hansen 2016).

Any vector of coefficients becomes a motion within the kinematic limits: a joint that would break one is
scaled down until it does not, and its offset is moved until its travel fits. Torque and the other checks
are refused by score.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from robots.arrays import FloatArray
from trajectories.errors import PlanError
from trajectories.information.matrix import NONE
from trajectories.motions.fourier import FourierMotion
from trajectories.motions.motion import Motion, MotionSequence
from trajectories.motions.segments import PiecewiseJerk, SegmentPlanner, Waypoint, hold
from trajectories.motions.trajectory import Repeat
from trajectories.search.problem import ExcitationProblem

if TYPE_CHECKING:
    import cma

HARMONICS = 5
FIRST_SIGMA = 0.3
REFUSED = 1e3
"""Score of a motion that a check refuses, plus its excess: worse than any that is driven."""

PHASES = 48
"""Begins of the period that are tried for the lead-in and lead-out."""


@dataclass
class FourierSearch:
    """One CMA-ES run from one seed; the same interface as the search over waypoints.

    Attributes:
        problem: what is sought.
        seed: fixes every trial.
        evaluations: most trials.
        periods: of the motion that is handed over.
        done: trials so far.
        best_score: of the best motion so far.
    """

    problem: ExcitationProblem
    seed: int
    evaluations: int
    periods: int = 1
    done: int = field(init=False, default=0)
    best_score: float = field(init=False, default=NONE)
    _period: float = field(init=False, repr=False)
    _strategy: cma.CMAEvolutionStrategy = field(init=False, repr=False)
    _best: FourierMotion = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._period = self.problem.duration - self._lead_time()
        if self._period <= 0.0:
            raise PlanError(
                f"{self.problem.duration:g} s leave no period between lead-in and lead-out, which take "
                f"{self._lead_time():.2f} s; allowed: a longer duration",
                constraint="duration",
            )
        generator = np.random.default_rng(self.seed)
        size = self.problem.limits.n * (2 * HARMONICS + 1)
        first = 0.3 * generator.standard_normal(size)
        self._strategy = _strategy(first, self.seed)
        self._best = self._motion(first)

    def advance(self, trials: int) -> None:
        """Do at least ``trials`` more, in whole generations, as long as ``evaluations`` lasts."""
        goal = min(self.done + trials, self.evaluations)
        while self.done < goal:
            candidates = self._strategy.ask()[: self.evaluations - self.done]
            scores = [self._evaluated(candidate) for candidate in candidates]
            self.done += len(candidates)
            if len(candidates) == self._strategy.popsize:
                self._strategy.tell(candidates, scores)

    def finished(self) -> Motion:
        """The best motion with its lead-in and lead-out, as long as the problem's duration.

        Raises:
            PlanError: when no begin of the period can be reached from the start and left to the goal in time.
        """
        start, goal = self.problem.start, self.problem.goal
        if start is None or goal is None:
            return self._best
        planner = SegmentPlanner(self.problem.limits)
        chosen: tuple[float, PiecewiseJerk, FourierMotion, PiecewiseJerk] | None = None
        for time in np.arange(PHASES) * (self._period / PHASES):
            motion = self._best.begun(float(time))
            state = motion.at(np.zeros(1))
            begin = Waypoint(state.position[0], state.velocity[0], state.acceleration[0])
            lead_in, lead_out = planner.connect(start, begin), planner.connect(begin, goal)
            if lead_in is None or lead_out is None:
                continue
            length = lead_in.duration + lead_out.duration
            allowed = self.problem.allows(lead_in) and self.problem.allows(lead_out)
            if allowed and (chosen is None or length < chosen[0]):
                chosen = (length, lead_in, motion, lead_out)
        if chosen is None:
            raise PlanError(
                "no lead-in and lead-out of the Fourier motion keep the limits", constraint="lead-in"
            )
        length, lead_in, motion, lead_out = chosen
        pause = self.problem.duration + (self.periods - 1) * self._period - (length + motion.duration)
        rest = (hold(goal.position, pause),) if pause > 1e-6 else ()
        return MotionSequence((lead_in, motion, lead_out, *rest))

    def repeat(self, motion: Motion) -> Repeat:
        """Where the periods are in what :meth:`finished` gave."""
        lead = motion.parts[0].duration if isinstance(motion, MotionSequence) else 0.0
        return Repeat(lead, self._period, self.periods)

    def _lead_time(self) -> float:
        """Time kept for lead-in and lead-out: two moves over half of the travel, from rest to rest."""
        if self.problem.start is None or self.problem.goal is None:
            return 0.0
        limits = self.problem.limits
        quarter = (limits.upper - limits.lower) / 4
        middle = (limits.upper + limits.lower) / 2
        ends = (Waypoint.at_rest(middle - quarter), Waypoint.at_rest(middle + quarter))
        move = SegmentPlanner(limits).connect(*ends)
        return 2.0 * move.duration if move is not None else 0.0

    def _evaluated(self, candidate: FloatArray) -> float:
        motion = self._motion(candidate)
        matrices = self.problem.matrices([motion.once()])
        if matrices is None:
            return REFUSED + self.problem.excess(motion.once())
        score = self.problem.objective.score(matrices[0])
        if score >= self.best_score:
            return min(score, REFUSED)
        if not self.problem.allows(motion.once()):
            return REFUSED + self.problem.excess(motion.once())
        self.best_score, self._best = score, motion
        return score

    def _motion(self, candidate: FloatArray) -> FourierMotion:
        """Coefficients in units of half the travel and of the velocity limits, brought within all limits."""
        limits, n = self.problem.limits, self.problem.limits.n
        values = np.asarray(candidate).reshape(2 * HARMONICS + 1, n)
        middle, half = (limits.upper + limits.lower) / 2, (limits.upper - limits.lower) / 2
        frequency = 2 * np.pi / self._period * np.arange(1, HARMONICS + 1)[:, np.newaxis]
        sine, cosine = (part * limits.velocity / frequency for part in np.split(values[1:], 2))
        raw = FourierMotion(self._period, self.periods, np.zeros(n), sine, cosine)
        extremes = raw.extremes()
        share = np.max(
            [
                (extremes.highest - extremes.lowest) / (2 * half),
                extremes.velocity / limits.velocity,
                extremes.acceleration / limits.acceleration,
                extremes.jerk / limits.jerk,
                np.ones(n),
            ],
            axis=0,
        )
        low, high = extremes.lowest / share, extremes.highest / share
        offset = np.clip(middle + half * values[0], limits.lower - low, limits.upper - high)
        motion = FourierMotion(self._period, self.periods, offset, sine / share, cosine / share)
        tool = self.problem.tool
        faster = tool.share(motion.once()) if tool is not None else 0.0
        return motion if faster <= 1.0 else motion.smaller(1.0 / faster)


def _strategy(first: FloatArray, seed: int) -> cma.CMAEvolutionStrategy:
    """A CMA-ES run; cma is loaded here because it takes a while and warns where there is no matplotlib."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        import cma
    # 0 stands for "take the time" in cma, so a seed is never 0.
    return cma.CMAEvolutionStrategy(first, FIRST_SIGMA, {"seed": seed % 2**31 + 1, "verbose": -9})
