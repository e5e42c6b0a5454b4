"""A motion of which only samples are known, as somebody else's file has it.

Between samples it is the cubic spline through them, whose pieces have constant jerk like our own segments.
A spline overshoots where the real jerk jumps, so velocity, acceleration and jerk are judged by the first,
second and third differences of the samples: each is a mean over one, two or three intervals, so a motion that
keeps its limits is never refused. What the rounding of the file adds to differences is taken off first.
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

_MOST_DIGITS = 16


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
        """Positions of the spline; derivatives by differences, without what rounding may have added."""
        position = np.append(
            self.spline.position, self.spline.at(np.array([self.duration])).position.T, axis=1
        )
        velocity, acceleration, jerk = (self._largest_difference(position, order) for order in (1, 2, 3))
        return replace(
            self.spline.extremes(),
            velocity=velocity[0],
            velocity_time=velocity[1],
            acceleration=acceleration[0],
            acceleration_time=acceleration[1],
            jerk=jerk[0],
            jerk_time=jerk[1],
        )

    def _largest_difference(self, position: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
        """Per joint the largest difference of an order over step^order, and the middle of its interval."""
        difference = np.abs(np.diff(position, n=order, axis=1)) / self.step**order
        # The differences of numbers that are each off by half a step add up to 2^(order−1) steps.
        rounding = 2.0 ** (order - 1) * self.resolution / self.step**order
        largest = np.maximum(difference.max(axis=1) - rounding, 0.0)
        middle = (difference.argmax(axis=1) + order / 2) * self.step
        return largest, np.asarray(middle, dtype=np.float64)


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
    """The coarsest decimal step to which values of some size are written."""
    distinct = np.unique(np.abs(values))
    distinct = distinct[distinct > 0.0]
    decades = np.floor(np.log10(distinct)).astype(np.int64)
    # Writers that keep so many digits round large values more; a few round numbers are a coincidence.
    groups = [distinct[decades == k] for k in np.unique(decades)]
    steps = [_decimal_step(group) for group in groups if group.size >= FEWEST]
    return max(steps) if steps else _decimal_step(distinct)


def _decimal_step(values: FloatArray) -> float:
    """The largest power of ten that values (N,) above 0 are multiples of; that of their last bit else."""
    if not values.size:
        return 0.0
    leading = int(np.floor(np.log10(values.max())))
    for decimals in range(-leading, _MOST_DIGITS - leading):
        if np.abs(values - np.round(values, decimals)).max() < 1e-14 * 10.0**leading:
            return float(10.0**-decimals)
    return float(10.0 ** (leading + 1 - _MOST_DIGITS))
