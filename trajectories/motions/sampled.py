"""A motion of which only samples are known, as somebody else's file has it.

Between samples it is the cubic spline through them, whose pieces have constant jerk like our own segments.
A spline overshoots in jerk where the real jerk jumps, so the jerk is judged by third differences: each is
the mean jerk over three intervals, so a motion that keeps its limit is never refused for it. What the
rounding of the file adds to differences is taken off first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from robots.arrays import FloatArray
from trajectories.errors import TrajectoryError
from trajectories.motions.motion import Extremes, MotionState
from trajectories.motions.segments import PiecewiseJerk

FEWEST = 8
"""Samples of which a motion can be made."""

_JITTER = 0.01
"""Largest departure of an interval from the mean one that counts as even."""

_MOST_DECIMALS = 12


@dataclass(frozen=True)
class SampledMotion:
    """The spline through samples ``step`` s apart that were written to ``resolution`` rad (or m)."""

    spline: PiecewiseJerk
    step: float
    resolution: float

    @property
    def duration(self) -> float:
        return self.spline.duration

    @property
    def joints(self) -> int:
        return self.spline.joints

    def at(self, time: FloatArray) -> MotionState:
        """The state of the spline at each time (N,), s."""
        return self.spline.at(time)

    def breaks(self) -> FloatArray:
        return self.spline.breaks()

    @property
    def jerk_rounding(self) -> float:
        """What the rounding of the samples alone may look like as a jerk, rad/s³ (or m/s³)."""
        return 4.0 * self.resolution / self.step**3

    def extremes(self) -> Extremes:
        """Of the spline; acceleration and jerk without what rounding may have added."""
        spline = self.spline.extremes()
        position = np.append(
            self.spline.position, self.spline.at(np.array([self.duration])).position.T, axis=1
        )
        third = np.abs(np.diff(position, n=3, axis=1)) / self.step**3
        worst = third.argmax(axis=1)
        acceleration = spline.acceleration - 6.0 * self.resolution / self.step**2
        return replace(
            spline,
            acceleration=np.maximum(acceleration, 0.0),
            jerk=np.maximum(third.max(axis=1) - self.jerk_rounding, 0.0),
            jerk_time=np.asarray((worst + 1.5) * self.step, dtype=np.float64),
        )


def sampled_motion(
    time: FloatArray, position: FloatArray, velocity: FloatArray | None = None
) -> SampledMotion:
    """The motion through samples.

    Args:
        time: (N,) s, evenly spaced.
        position: N × joints, rad (or m).
        velocity: N × joints at the samples, of which the first and last are used; nothing is assumed of
            the ends where not given.

    Raises:
        TrajectoryError: too few samples, uneven times, or values that are not finite.
    """
    if len(time) < FEWEST:
        raise TrajectoryError(f"{len(time)} samples; allowed: {FEWEST} or more", constraint="samples")
    for name, values in (("time", time[:, np.newaxis]), ("position", position)):
        bad = np.argwhere(~np.isfinite(values))
        if bad.size:
            raise TrajectoryError(f"{name} is not a number at sample {bad[0][0]}", constraint="samples")
    step = float((time[-1] - time[0]) / (len(time) - 1))
    uneven = int(np.argmax(np.abs(np.diff(time) - step)))
    if step <= 0.0 or abs(time[uneven + 1] - time[uneven] - step) > _JITTER * step:
        raise TrajectoryError(
            f"samples are not evenly spaced: {time[uneven + 1] - time[uneven]:.6g} s to the next one, "
            f"{step:.6g} s on average",
            constraint="samples",
            time=float(time[uneven]),
        )
    even = np.asarray(np.arange(len(time)) * step, dtype=np.float64)
    if velocity is None:
        spline = CubicSpline(even, position, axis=0)
    else:
        spline = CubicSpline(even, position, axis=0, bc_type=((1, velocity[0]), (1, velocity[-1])))
    third, second, first, value = (np.ascontiguousarray(c.T) for c in spline.c)
    pieces = PiecewiseJerk(
        duration=float(even[-1]),
        start=np.tile(even[:-1], (position.shape[1], 1)),
        position=value,
        velocity=first,
        acceleration=2.0 * second,
        jerk=6.0 * third,
    )
    return SampledMotion(pieces, step, _resolution(position))


def _resolution(values: FloatArray) -> float:
    """The decimal step that all values are multiples of; 0 where they have too many digits to tell."""
    for decimals in range(_MOST_DECIMALS):
        if np.abs(values - np.round(values, decimals)).max() < 1e-13 * max(1.0, np.abs(values).max()):
            return float(10.0**-decimals)
    return 0.0
