"""Search for the Fourier coefficients of the most informative periodic motion, by CMA-ES (Hansen 2016).

Any vector of coefficients becomes a motion within the kinematic limits: a joint that would break one is
scaled down until it does not, and its offset is moved until its travel fits. Torque and the other checks
are refused by score, and so is a period that cannot be led in and out: the best so far can be driven.
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
from trajectories.motions.segments import SegmentPlanner, Waypoint, hold
from trajectories.search.leads import Lead, LeadPlanner
from trajectories.search.problem import ExcitationProblem
from trajectories.trajectory import Repeat

if TYPE_CHECKING:
    import cma

HARMONICS = 5
FIRST_SIGMA = 0.3
REFUSED = 1e3
"""Score of a motion that a check refuses, plus its excess: worse than any that is driven."""

LEAD_SHARE = 1 / 3
"""Most of the duration that is kept for lead-in and lead-out where the tool makes them slow."""


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
    _lead: Lead | None = field(init=False, default=None, repr=False)

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
        goal = self.problem.goal
        if self.problem.start is None or goal is None:
            return self._best
        lead = self._lead or self._leads().of(self._best)
        if lead is None:
            broken = self.problem.complaint(self._best.once())
            raise self._leads().refusal(self._best) if broken is None else PlanError.of(broken)
        motion = self._best.begun(lead.begin)
        pause = self.problem.duration - self._period - lead.duration
        rest = (hold(goal.position, pause),) if pause > 1e-6 else ()
        return MotionSequence((lead.into, motion, lead.out, *rest))

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
        if move is None:
            return 0.0
        free, tool = 2.0 * move.duration, self.problem.tool
        slower = free * max(1.0, tool.share(move)) if tool is not None else free
        return max(free, min(slower, LEAD_SHARE * self.problem.duration))

    def _leads(self) -> LeadPlanner:
        return LeadPlanner(self.problem, self.problem.duration - self._period)

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
        lead = None
        if self.problem.start is not None and self.problem.goal is not None:
            lead = self._leads().of(motion)
            if lead is None:
                return REFUSED + self._leads().excess(motion)
        self.best_score, self._best, self._lead = score, motion, lead
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
