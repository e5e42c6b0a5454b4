"""What an exciting motion is to achieve and to keep, for any family of motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ident.effects import State
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray
from trajectories.constraints.tool_speed import ToolSpeed
from trajectories.errors import TrajectoryError
from trajectories.information.counted_rows import CountedRows
from trajectories.information.matrix import ROW_RATE
from trajectories.limits import Limits
from trajectories.motions.motion import Motion, MotionState, joined_states, midpoints
from trajectories.motions.segments import Waypoint


class Check(Protocol):
    """One condition on a motion."""

    def allows(self, motion: Motion) -> bool:
        """Whether a motion keeps it; quick, and never true of a motion that does not."""
        ...

    def excess(self, motion: Motion) -> float:
        """How far a motion is from keeping it, from a quick look; 0 where nothing was seen."""
        ...

    def require(self, motion: Motion) -> None:
        """Raise where a motion breaks it.

        Raises:
            TrajectoryError: names constraint, joint and time.
        """
        ...


Regressor = Callable[[MotionState], FloatArray]
"""The regressor that information is of: samples × joints × b of the states of a motion."""


class Score(Protocol):
    """What is minimised, from an information matrix."""

    def score(self, matrix: FloatArray, unless_above: float = ...) -> float:
        """Score of a matrix (b × b); any number above ``unless_above`` where that is already clear."""
        ...


@dataclass(frozen=True)
class ExcitationProblem:
    """What is sought.

    Attributes:
        regressor: base regressor of the arm.
        sigma: torque noise per joint (n,), the weights.
        prior: parameters (b,) for a first look at the torque, compared with ``limits.torque``.
        limits: of the arm.
        duration: longest motion, s.
        start, goal: fixed ends; None for an end that may be anywhere, in motion.
        objective: what is minimised.
        checks: further conditions on each segment, the dear ones last.
        counted: which rows count; None for all.
        tool: limit of the tool's speed; segments are slowed down to it. None for no limit.
        slow_passes: whether segments may also last longer than they need.
        whole: whether the regressor looks along time, so that segments cannot be judged one by one.
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
    objective: Score
    checks: tuple[Check, ...] = ()
    counted: CountedRows | None = None
    tool: ToolSpeed | None = None
    slow_passes: bool = False
    whole: bool = False
    search_rate: float = 50.0

    def allows(self, motion: Motion) -> bool:
        """Whether a motion passes all checks."""
        return all(check.allows(motion) for check in self.checks)

    def complaint(self, motion: Motion) -> TrajectoryError | None:
        """What a motion breaks first; None where nothing."""
        try:
            for check in self.checks:
                check.require(motion)
        except TrajectoryError as error:
            return error
        return None

    def excess(self, motion: Motion) -> float:
        """How far a motion is from passing all checks."""
        return sum(check.excess(motion) for check in self.checks)

    def matrices(self, motions: Sequence[Motion]) -> list[FloatArray] | None:
        """The information at 100 rows per second of each motion, in one call of the regressor.

        None where the prior torque breaks its limit. Rows are those of the search.
        """
        counts = [max(1, int(np.ceil(motion.duration * self.search_rate))) for motion in motions]
        times = [midpoints(motion.duration, count) for motion, count in zip(motions, counts, strict=True)]
        states = [motion.at(time) for motion, time in zip(motions, times, strict=True)]
        # Only one motion has times that follow each other.
        together = replace(states[0], time=times[0]) if len(states) == 1 else joined_states(states)
        columns = self.regressor(together)
        if (np.abs(columns @ self.prior) > self.limits.torque).any():
            return None
        columns /= self.sigma[:, np.newaxis]
        matrices, first = [], 0
        for motion, state, count in zip(motions, states, counts, strict=True):
            step = motion.duration / count
            rows = columns[first : first + count]
            if self.counted is not None:
                rows *= self.counted(state, step)[:, :, np.newaxis]
            flat = rows.reshape(-1, columns.shape[2])
            matrices.append(flat.T @ flat * (step * ROW_RATE))
            first += count
        return matrices


@dataclass(frozen=True)
class BaseRegressor:
    """The base regressor of an arm's model."""

    base: BaseParameters

    def __call__(self, state: MotionState) -> FloatArray:
        """samples × joints × b."""
        return self.base.columns(State(state.position, state.velocity, state.acceleration, state.time))
