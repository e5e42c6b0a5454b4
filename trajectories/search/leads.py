"""Lead-in and lead-out of a periodic motion: from rest into it, and out of it to rest.

The period may begin anywhere in it, so many begins are tried, those that are reached soonest first. The
quickest way in may break what ruckig knows nothing of (torque, tool speed, distances); it is then made slower
before the begin is given up.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trajectories.errors import PlanError, TrajectoryError
from trajectories.motions.fourier import FourierMotion
from trajectories.motions.segments import PiecewiseJerk, SegmentPlanner, Waypoint
from trajectories.search.problem import ExcitationProblem

PHASES = 48
"""Begins of the period that are tried."""

PACES = (1.0, 1.2, 1.5, 2.0, 2.7, 4.0)
"""Times the shortest duration that a lead-in or lead-out may last."""

_NO_LEAD = 10.0
"""Excess of a motion that has no lead within the kinematic limits."""


@dataclass(frozen=True)
class Lead:
    """How a periodic motion is begun and ended.

    Attributes:
        begin: where in the period it is entered and left, s.
        into, out: from rest to there, and from there to rest.
    """

    begin: float
    into: PiecewiseJerk
    out: PiecewiseJerk

    @property
    def duration(self) -> float:
        """Of both, s."""
        return self.into.duration + self.out.duration


class LeadPlanner:
    """Leads between a problem's start and goal and any periodic motion.

    Args:
        problem: its ends, its limits and its checks.
        time: that lead-in and lead-out may take together, s.
    """

    def __init__(self, problem: ExcitationProblem, time: float) -> None:
        if problem.start is None or problem.goal is None:
            raise ValueError("a motion without fixed ends has no leads")
        self.problem, self.time = problem, time
        self._start, self._goal = problem.start, problem.goal
        self._planner = SegmentPlanner(problem.limits)

    def of(self, motion: FourierMotion) -> Lead | None:
        """The lead of the begin that is reached soonest; None where every begin breaks something."""
        for quickest in self._quickest(motion):
            if quickest.duration > self.time:
                return None
            entry = _state(motion, quickest.begin)
            into = self._slow_enough(self._start, entry, quickest.into, self.time - quickest.out.duration)
            if into is None:
                continue
            out = self._slow_enough(entry, self._goal, quickest.out, self.time - into.duration)
            if out is not None:
                return Lead(quickest.begin, into, out)
        return None

    def excess(self, motion: FourierMotion) -> float:
        """How far the quickest lead is from being one: what it breaks, and its time beyond what there is."""
        quickest = next(self._quickest(motion), None)
        if quickest is None:
            return _NO_LEAD
        late = max(0.0, quickest.duration / self.time - 1.0)
        return late + self.problem.excess(quickest.into) + self.problem.excess(quickest.out)

    def refusal(self, motion: FourierMotion) -> PlanError:
        """Why there is no lead: what the quickest one breaks, or the time."""
        quickest = next(self._quickest(motion), None)
        if quickest is None:
            return PlanError(
                "no lead-in and lead-out of the Fourier motion keep position, velocity, acceleration, jerk",
                constraint="lead-in",
            )
        if quickest.duration > self.time:
            return PlanError(
                f"lead-in and lead-out of the Fourier motion take {quickest.duration:.2f} s; allowed: "
                f"{self.time:.2f} s; a longer duration gives them more",
                constraint="duration",
            )
        for name, part in (("lead-in", quickest.into), ("lead-out", quickest.out)):
            broken = self.problem.complaint(part)
            if broken is not None:
                return _named(f"{name} of the Fourier motion", broken)
        return PlanError("no lead-in and lead-out of the Fourier motion fit the time", constraint="duration")

    def _quickest(self, motion: FourierMotion) -> Iterator[Lead]:
        """Leads within the kinematic limits, the shortest first, one for each begin."""
        leads = []
        for begin in np.arange(PHASES) * (motion.period / PHASES):
            entry = _state(motion, float(begin))
            into, out = self._planner.connect(self._start, entry), self._planner.connect(entry, self._goal)
            if into is not None and out is not None:
                leads.append(Lead(float(begin), into, out))
        return iter(sorted(leads, key=lambda lead: lead.duration))

    def _slow_enough(
        self, start: Waypoint, goal: Waypoint, quickest: PiecewiseJerk, time: float
    ) -> PiecewiseJerk | None:
        """The segment, as much slower as the checks need it and the time (s) allows."""
        for pace in PACES:
            duration = quickest.duration * pace
            if duration > time:
                return None
            segment = quickest if pace == 1.0 else self._planner.connect(start, goal, duration)
            if segment is not None and self.problem.allows(segment):
                return segment
        return None


def _state(motion: FourierMotion, begin: float) -> Waypoint:
    state = motion.begun(begin).at(np.zeros(1))
    return Waypoint(state.position[0], state.velocity[0], state.acceleration[0])


def _named(what: str, broken: TrajectoryError) -> PlanError:
    error = PlanError(f"{what}: {broken}")
    error.constraint, error.joint, error.time = broken.constraint, broken.joint, broken.time
    return error
