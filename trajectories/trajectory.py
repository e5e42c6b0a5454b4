"""What a planner hands over: a motion sampled at the bus cycle, and how it was judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from robots.arrays import FloatArray
from trajectories.collision import Nearest
from trajectories.errors import TrajectoryError
from trajectories.limits import Use
from trajectories.motion import Motion, MotionSequence, MotionState

ExcitingFamily = Literal["ruckig", "fourier"]
Family = ExcitingFamily | Literal["move"]


@dataclass(frozen=True)
class Detail:
    """How a trajectory was judged before anything moves.

    Attributes:
        condition: condition number of the weighted base regressor; NaN for a plain move.
        log_det: −log det(G) / b at 100 rows per second.
        trace: tr C, the sum of the predicted variances at 100 rows per second.
        evaluations: trials of the search.
        uses: use of each limit.
        nearest: where it comes closest to touching something; None where nothing was watched.
        parameters: names of the base parameters.
        percent_sigma: predicted 100·σ/|β| of each, with the prior as β; inf where the prior is 0.
    """

    condition: float = float("nan")
    log_det: float = float("nan")
    trace: float = float("nan")
    evaluations: int = 0
    uses: tuple[Use, ...] = ()
    nearest: Nearest | None = None
    parameters: tuple[str, ...] = ()
    percent_sigma: tuple[float, ...] = ()


@dataclass(frozen=True)
class Trajectory:
    """A motion and its samples; arrays are samples × joints, SI.

    Attributes:
        time: (N,) s, multiples of the cycle time from 0; the last sample is at or just after the end.
        position, velocity, acceleration: exact at those times.
        motion: the motion itself, for any other time.
        family: how it was made.
        seed: that it was made from.
        score: of the planner's objective; smaller is better; NaN for a plain move.
        detail: how it was judged.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    motion: Motion
    family: Family
    seed: int
    score: float
    detail: Detail

    @classmethod
    def sampled(
        cls,
        motion: Motion,
        cycle_time: float,
        *,
        family: Family,
        seed: int = 0,
        score: float = float("nan"),
        detail: Detail | None = None,
    ) -> Trajectory:
        """Sample a motion at every multiple of the cycle time, s, until it has ended.

        Raises:
            TrajectoryError: when the cycle time is not a positive number.
        """
        if not 0.0 < cycle_time < float("inf"):
            raise TrajectoryError(f"cycle time is {cycle_time} s; allowed: above 0", constraint="cycle time")
        cycles = int(np.ceil(motion.duration / cycle_time - 1e-6))
        time = np.asarray(np.arange(cycles + 1) * cycle_time, dtype=np.float64)
        state = motion.at(time)
        return cls(
            time,
            state.position,
            state.velocity,
            state.acceleration,
            motion,
            family,
            seed,
            score,
            detail or Detail(),
        )

    @property
    def cycle_time(self) -> float:
        return float(self.time[1] - self.time[0])

    @property
    def duration(self) -> float:
        """Of the motion, s."""
        return self.motion.duration

    def at(self, time: FloatArray) -> MotionState:
        """The exact state at any times (N,), s."""
        return self.motion.at(time)

    def resampled(self, cycle_time: float) -> Trajectory:
        """The same motion sampled at another cycle time, s."""
        return Trajectory.sampled(
            self.motion,
            cycle_time,
            family=self.family,
            seed=self.seed,
            score=self.score,
            detail=self.detail,
        )

    def repeated(self, periods: int) -> Trajectory:
        """The motion several times without a pause; repeats give the noise floor.

        Raises:
            TrajectoryError: when it does not end as it starts, or periods < 1.
        """
        if periods < 1:
            raise TrajectoryError(f"periods is {periods}; allowed: 1 or more", constraint="periods")
        ends = self.motion.at(np.array([0.0, self.duration]))
        for name in ("position", "velocity", "acceleration"):
            first, last = getattr(ends, name)
            if not np.allclose(first, last, atol=1e-6):
                joint = int(np.argmax(np.abs(last - first)))
                raise TrajectoryError(
                    f"joint {joint + 1} ends at another {name} than it starts with, so it cannot be repeated",
                    constraint="periods",
                    time=self.duration,
                )
        motion = self.motion if periods == 1 else MotionSequence((self.motion,) * periods)
        return Trajectory.sampled(
            motion,
            self.cycle_time,
            family=self.family,
            seed=self.seed,
            score=self.score,
            detail=self.detail,
        )
