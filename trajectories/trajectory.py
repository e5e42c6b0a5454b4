"""What a planner hands over: a motion sampled at the bus cycle, and how it was judged."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robots.arrays import FloatArray
from trajectories.constraints.collision import Nearest
from trajectories.constraints.tool_speed import FastestTool
from trajectories.constraints.use import Use
from trajectories.errors import TrajectoryError
from trajectories.information.prediction import Prediction
from trajectories.motions.motion import Motion, MotionSequence, MotionState, StretchedMotion

ExcitingFamily = Literal["ruckig", "fourier"]
Family = ExcitingFamily | Literal["move", "imported"]


@dataclass(frozen=True)
class Detail:
    """How a trajectory was judged before anything moves.

    Attributes:
        evaluations: trials of the search.
        uses: use of each limit.
        nearest: where it comes closest to touching something; None where nothing was watched.
        tool: where the tool is fastest; None for a plain move.
        prediction: what identification will make of it; None for a plain move.
    """

    evaluations: int = 0
    uses: tuple[Use, ...] = ()
    nearest: Nearest | None = None
    tool: FastestTool | None = None
    prediction: Prediction | None = None

    @property
    def condition(self) -> float:
        """Condition number of the weighted base regressor; NaN for a plain move."""
        return float("nan") if self.prediction is None else self.prediction.information.condition

    @property
    def log_det(self) -> float:
        """−log det(G) / b at 100 rows per second; NaN for a plain move."""
        return float("nan") if self.prediction is None else self.prediction.information.log_det

    @property
    def trace(self) -> float:
        """tr C, the sum of the variances at 100 rows per second; NaN for a plain move."""
        return float("nan") if self.prediction is None else self.prediction.information.trace

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the base parameters."""
        return () if self.prediction is None else self.prediction.names

    @property
    def percent_sigma(self) -> tuple[float, ...]:
        """Predicted 100·σ/|β| of each; inf where β is expected to be 0 or the motion does not show it."""
        return () if self.prediction is None else tuple(self.prediction.percent_sigma.tolist())


_WHOLE = 1e-6
"""Cycles by which a period may be off a whole number, by rounding."""


@dataclass(frozen=True)
class Repeat:
    """The part of a motion that comes again and again; the spread of repeats is the noise floor.

    Attributes:
        start: when the first one begins, s.
        period: how long each lasts, s.
        count: how many there are.
    """

    start: float
    period: float
    count: int

    def slowed(self, factor: float) -> Repeat:
        """The same repeats in 1/factor of the time."""
        return Repeat(self.start / factor, self.period / factor, self.count)

    def whole_cycles_at(self, factor: float, cycle_time: float) -> float:
        """The highest speed up to ``factor`` at which a period is a whole number of cycles.

        Otherwise each period is sampled at other points of the path, and their spread is no noise floor.
        """
        cycles = np.ceil(self.period / (factor * cycle_time) - _WHOLE)
        return min(factor, float(self.period / (cycles * cycle_time)))


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
        repeat: what of it is repeated; None where nothing is.
        speed: < 1 where it is a slow run of a planned motion.
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
    repeat: Repeat | None = None
    speed: float = 1.0

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
        repeat: Repeat | None = None,
        speed: float = 1.0,
    ) -> Trajectory:
        """Sample a motion at every multiple of the cycle time, s, until it has ended.

        Raises:
            TrajectoryError: when the cycle time is not a positive number.
        """
        time = sample_times(motion.duration, cycle_time)
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
            repeat,
            speed,
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
        return self._of(self.motion, cycle_time)

    def slowed(self, factor: float) -> Trajectory:
        """The same path in 1/factor of the time: the careful first run. What was judged is left behind.

        A little slower where that makes a repeated period a whole number of cycles.

        Raises:
            TrajectoryError: the factor is not above 0, up to 1.
        """
        require_share(factor)
        repeat = self.repeat
        if repeat is not None:
            factor = repeat.whole_cycles_at(factor, self.cycle_time)
            repeat = repeat.slowed(factor)
        motion = stretched(self.motion, factor)
        slow = self._of(motion, self.cycle_time)
        return replace(slow, detail=Detail(), repeat=repeat, speed=self.speed * factor)

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
        if periods == 1:
            return self
        motion = MotionSequence((self.motion,) * periods)
        return replace(self._of(motion, self.cycle_time), repeat=Repeat(0.0, self.duration, periods))

    def _of(self, motion: Motion, cycle_time: float) -> Trajectory:
        return Trajectory.sampled(
            motion,
            cycle_time,
            family=self.family,
            seed=self.seed,
            score=self.score,
            detail=self.detail,
            repeat=self.repeat,
            speed=self.speed,
        )


def sample_times(duration: float, cycle_time: float) -> FloatArray:
    """Multiples of the cycle time, s, until the duration is reached, (N,).

    Raises:
        TrajectoryError: when the cycle time is not a positive number.
    """
    if not 0.0 < cycle_time < float("inf"):
        raise TrajectoryError(f"cycle time is {cycle_time} s; allowed: above 0", constraint="cycle time")
    cycles = max(1, int(np.ceil(duration / cycle_time - 1e-6)))
    return np.asarray(np.arange(cycles + 1) * cycle_time, dtype=np.float64)


def stretched(motion: Motion, factor: float) -> Motion:
    """A motion in 1/factor of the time.

    Raises:
        TrajectoryError: the factor is not above 0, up to 1.
    """
    require_share(factor)
    return motion if factor == 1.0 else StretchedMotion(motion, factor)


def require_share(factor: float) -> None:
    """Refuse a speed that is no share of the planned one.

    Raises:
        TrajectoryError: the factor is not above 0, up to 1.
    """
    if not 0.0 < factor <= 1.0:
        raise TrajectoryError(f"speed is {factor}; allowed: above 0, up to 1", constraint="speed")
