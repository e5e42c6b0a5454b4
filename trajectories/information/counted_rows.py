"""Which rows of a motion identification will use: those in which joint and drives are fast enough.

Below ``minimum_speed`` friction is not Coulomb's, and the decimation filter spreads that over
``standstill_margin``; :mod:`ident.preparation.observation` leaves those rows out. A search that
counted them would be paid for rows that nobody uses: it would like joints to creep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation

from robots.arrays import BoolArray, FloatArray
from robots.description import Robot
from trajectories.motions.motion import MotionState


@dataclass(frozen=True)
class CountedRows:
    """The search's quick form of identification's rule, on rows in the middle of equal intervals.

    Attributes:
        speed: (n,) slowest speed of joints and drives that counts, rad/s (or m/s).
        transmission: (n × n) drive output = T · joint.
        margin: s that are left out around a slow row.
    """

    speed: FloatArray
    transmission: FloatArray
    margin: float

    @classmethod
    def of(cls, robot: Robot) -> CountedRows | None:
        """The rule of an arm's settings; None where every row counts."""
        settings = robot.identification
        if settings.minimum_speed == 0.0:
            return None
        return cls(
            settings.minimum_speed * robot.velocity_limits,
            robot.transmission_matrix,
            settings.standstill_margin,
        )

    def __call__(self, state: MotionState, step: float) -> BoolArray:
        """samples × joints: whether a row counts.

        Args:
            state: in the middles of intervals that follow each other.
            step: length of each, s. An interval in which the speed may pass zero is slow.
        """
        slow = self._slow(state.velocity, state.acceleration, step)
        drives = self._slow(
            state.velocity @ self.transmission.T, state.acceleration @ self.transmission.T, step
        )
        slow |= drives @ (self.transmission != 0.0)
        reach = round(self.margin / step)
        if reach:
            slow = binary_dilation(slow, np.ones((2 * reach + 1, 1), dtype=np.bool_))
        return np.asarray(~slow)

    def _slow(self, velocity: FloatArray, acceleration: FloatArray, step: float) -> BoolArray:
        return np.asarray(np.abs(velocity) <= self.speed + np.abs(acceleration) * (step / 2))
