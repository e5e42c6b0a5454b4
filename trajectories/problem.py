"""What an exciting motion is to achieve and to keep, for any family of motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from robots.arrays import FloatArray
from trajectories.information import ROW_RATE, Information, Objective
from trajectories.limits import Limits
from trajectories.motion import Motion, MotionState, midpoints
from trajectories.segments import Waypoint

Regressor = Callable[[MotionState], FloatArray]
"""The base regressor: samples × joints × b of the states of a motion."""

Check = Callable[[Motion], bool]
"""Whether a motion may be driven; called only on motions that would be an improvement."""


@dataclass(frozen=True)
class ExcitationProblem:
    """What is sought.

    Attributes:
        regressor: base regressor of the arm.
        sigma: torque noise per joint (n,), the weights.
        prior: base parameters (b,) for a first look at the torque, compared with ``limits.torque``.
        limits: of the arm.
        duration: longest motion, s.
        start, goal: fixed ends; None for an end that may be anywhere, in motion.
        objective: what is minimised.
        checks: further conditions on each segment, the dear ones last.
        search_rate: rows per second at which the search looks. A coarse look is quick but flatters: the
            search finds motions whose friction changes sign between the rows.
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
    search_rate: float = 50.0

    def weighted(self, state: MotionState) -> FloatArray | None:
        """Base regressor over σ, samples × joints × b; None where the prior torque breaks its limit."""
        columns = self.regressor(state)
        if (np.abs(columns @ self.prior) > self.limits.torque).any():
            return None
        return columns / self.sigma[:, np.newaxis]

    def allows(self, motion: Motion) -> bool:
        """Whether a motion passes all checks."""
        return all(check(motion) for check in self.checks)


def information_of(motion: Motion, problem: ExcitationProblem) -> Information:
    """The information of a motion from rows at 100 Hz."""
    rows = max(1, round(motion.duration * ROW_RATE))
    columns = problem.regressor(motion.at(midpoints(motion.duration, rows))) / problem.sigma[:, np.newaxis]
    flat = columns.reshape(-1, columns.shape[2])
    return Information(flat.T @ flat * (motion.duration / rows * ROW_RATE))
