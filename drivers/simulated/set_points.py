"""What the position loops follow between two SYNCs: interpolated targets, or a ramp to standstill."""

from __future__ import annotations

from enum import IntEnum
from typing import Literal

import numpy as np

from robots.arrays import BoolArray, FloatArray, IntArray

Interpolation = Literal["linear", "spline", "hold"]


class AxisMode(IntEnum):
    """What one axis does in the coming SYNC period."""

    BRAKED = 0
    """Brake engaged, no current."""
    TRACKING = 1
    """Following the target positions."""
    STOPPING = 2
    """Slowing its set-point down to standstill, then holding it."""


class SetPoints:
    """Set-points of n axes, at the drive outputs.

    In TRACKING with ``linear`` interpolation the set-point runs, from SYNC k to SYNC k+1, from the target
    latched at SYNC k−1 to the one latched at SYNC k; with ``spline`` its velocity, too, is continuous
    (the uniform quadratic B-spline over the last three targets); with ``hold`` it is the target latched
    at SYNC k.

    Args:
        n: number of axes.
        interpolation: as in the arm's description.
    """

    def __init__(self, n: int, interpolation: Interpolation) -> None:
        self._interpolation = interpolation
        self.modes: IntArray = np.full(n, AxisMode.BRAKED, dtype=np.int64)
        self.deceleration = np.full(n, np.inf)
        self._before = np.zeros(n)
        self._start = np.zeros(n)
        self._end = np.zeros(n)
        self._samples = 1
        self._sample_time = 1.0
        self._stopping: BoolArray = np.zeros(n, dtype=np.bool_)
        self._any_stopping = False
        self._tracking: BoolArray = np.zeros(n, dtype=np.bool_)
        self.position = np.zeros(n)
        self.velocity = np.zeros(n)
        self.acceleration = np.zeros(n)
        """The second difference of the targets over the period; of a ramp, its own."""

    def set_modes(self, modes: IntArray) -> None:
        """Takes the modes for the coming period, (n,)."""
        self.modes = modes
        self._stopping = modes == AxisMode.STOPPING
        self._any_stopping = bool(self._stopping.any())

    def start_at(self, axes: BoolArray, position: FloatArray) -> None:
        """Begins to track at the present position: axes (n,), position (n,)."""
        for target in (self._start, self._end):
            target[axes] = position[axes]
        self.position[axes] = position[axes]
        self.velocity[axes] = 0.0
        self.acceleration[axes] = 0.0

    def latch(self, targets: FloatArray, period: float, samples: int) -> None:
        """A SYNC: new targets (n,) for the period (s) of so many controller samples."""
        tracking = self.modes == AxisMode.TRACKING
        self._before = self._start
        self._start = self._end
        self._end = np.where(tracking, targets, self.position)
        self._samples = samples
        self._sample_time = period / samples
        self._tracking = tracking
        change = second_difference((self._before, self._start, self._end), period)
        self.acceleration = np.where(tracking, change, 0.0)

    def sample(self, index: int) -> None:
        """Moves ``position`` and ``velocity`` to controller sample ``index`` of this period."""
        tracked, velocity = self._interpolated(index / self._samples)
        self.velocity = np.where(self._tracking, velocity, self.velocity)
        if not self._any_stopping:
            self.position = tracked
            return
        slower = np.maximum(np.abs(self.velocity) - self.deceleration * self._sample_time, 0.0)
        ramp_velocity = np.sign(self.velocity) * slower
        braking = (ramp_velocity - self.velocity) / self._sample_time
        self.acceleration = np.where(self._stopping, braking, self.acceleration)
        ramp = self.position + ramp_velocity * self._sample_time
        self.velocity = np.where(self._stopping, ramp_velocity, self.velocity)
        self.position = np.where(self._stopping, ramp, tracked)
        # A drive that follows again after a stop goes on from where it stands.
        self._start = np.where(self._stopping, self.position, self._start)
        self._end = np.where(self._stopping, self.position, self._end)

    def _interpolated(self, share: float) -> tuple[FloatArray, FloatArray]:
        """Set-point and its velocity, (n,), when a share of the period (0 to 1) is over."""
        period = self._samples * self._sample_time
        return interpolate(self._interpolation, (self._before, self._start, self._end), share, period)

    def stopped(self) -> BoolArray:
        """True for stopping axes whose set-point stands still, (n,)."""
        return np.asarray(self._stopping & (self.velocity == 0.0))


def interpolate(
    interpolation: Interpolation,
    targets: tuple[FloatArray, FloatArray, FloatArray],
    share: float,
    period: float,
) -> tuple[FloatArray, FloatArray]:
    """Set-points and their velocities within a SYNC period.

    Args:
        interpolation: as in the arm's description.
        targets: those latched two SYNCs, one SYNC and no SYNC before the period began, of equal shapes.
        share: of the period that is over, 0 to 1.
        period: s.
    """
    before, start, end = targets
    last, coming = start - before, end - start
    if interpolation == "spline":
        middle = start - 0.5 * last
        way = share * last + 0.5 * share**2 * (coming - last)
        return middle + way, (last + share * (coming - last)) / period
    if interpolation == "linear":
        return start + share * coming, coming / period
    return end, coming / period


def second_difference(targets: tuple[FloatArray, FloatArray, FloatArray], period: float) -> FloatArray:
    """Acceleration that three targets in a row (as in :func:`interpolate`) ask for."""
    before, start, end = targets
    return np.asarray((end - 2 * start + before) / period**2)
