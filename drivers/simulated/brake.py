"""Holding brakes at the drive outputs."""

from __future__ import annotations

import numpy as np

from robots.arrays import BoolArray, FloatArray

_CREEP_SPEED = 1e-5
"""Speed at which an engaged brake gives half its torque, rad/s or m/s."""


class Brakes:
    """One brake per axis: a torque against the motion that hardly depends on the speed.

    The torque is ``level · w_new / (|w| + creep speed)``, linear in the new velocity, so that a
    plant that solves for it is stable at any step. An engaged brake under load creeps less than its
    creep speed.

    Args:
        level: holding torque of each axis, (n,), N·m.
    """

    def __init__(self, level: FloatArray) -> None:
        self._level = np.array(level, dtype=np.float64)
        self.engaged: BoolArray = np.ones(self._level.size, dtype=np.bool_)
        self.any = True
        self.all = True

    def engage(self, engaged: BoolArray) -> None:
        """Engages the brakes that are True and releases the others, (n,)."""
        self.engaged = engaged.copy()
        self.any, self.all = bool(engaged.any()), bool(engaged.all())

    def slope(self, velocity: FloatArray) -> FloatArray:
        """Torque per new velocity in the coming step, (n,), N·m·s/rad."""
        return np.asarray(self.engaged * self._level / (np.abs(velocity) + _CREEP_SPEED))
