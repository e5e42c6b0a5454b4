"""Dry friction of the plant: a bristle that bends before it slides (Dahl 1968, LuGre 1995).

A sign function of the velocity cannot hold a load at standstill. A bristle can: it bends by a tiny
*pre-sliding displacement* and holds any torque below the Coulomb level for ever, as a real gear does.
With s the bristle's deflection relative to its full bend (|s| ≤ 1), w the velocity and d the width,

    ds/dt = w/d − |w|/d · s,     torque = Fc·s + damping while it bends.

For a velocity that is constant over a step this has an exact solution, s(w). Its tangent at the
predicted velocity makes the torque ``constant + slope · w_new``, which the plant solves for w_new: the
stiff bristle then sets no limit to the step, and where it slides (s = ±1) the slope is zero and the
torque is Fc exactly.
"""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray

_DAMPING_SPEED = 50.0
"""Bristle damping dies out above this many widths per second, so that sliding is purely Coulomb."""


class Bristle:
    """Dry friction at the drive outputs, n axes at once.

    Args:
        level: Coulomb torque of each axis, (n,), N·m.
        width: pre-sliding displacement of each axis, (n,), rad.
        inertia: inertia that the bristle's damping is matched to, (n,), kg·m².
        step: plant step, s.
    """

    def __init__(self, level: FloatArray, width: FloatArray, inertia: FloatArray, step: float) -> None:
        self.level = np.array(level, dtype=np.float64)
        self._widths_per_step = step / width
        # c = √(stiffness · inertia) is critical damping of half the ratio; torque c·d·ds/dt over one step.
        self._damping = np.sqrt(self.level / width * inertia) * width / step
        self._per_damping_speed = 1.0 / (_DAMPING_SPEED * width)
        self.deflection = np.zeros_like(self.level)
        self._offset = np.zeros_like(self.level)
        self._slope = np.zeros_like(self.level)

    def linearise(self, predicted: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Torque at the end of the coming step as ``constant + slope · new velocity``.

        Args:
            predicted: an estimate of the velocity at the end of the step, (n,), rad/s.

        Returns:
            constant (n,) in N·m and slope (n,) in N·m·s/rad.
        """
        direction = np.copysign(1.0, predicted)
        decay = np.exp(-np.abs(predicted) * self._widths_per_step)
        towards = direction - self.deflection
        # s(w) = s + (sign w − s)(1 − decay);  ds/dw = (1 − s·sign w)·decay·step/d.
        self._slope = direction * towards * decay * self._widths_per_step
        bent = towards * (1.0 - decay) - self._slope * predicted
        self._offset = self.deflection + bent
        damping = self._damping * np.exp(-np.square(predicted * self._per_damping_speed))
        constant = self.level * self._offset + damping * bent
        return constant, (self.level + damping) * self._slope

    def advance(self, new_velocity: FloatArray) -> None:
        """Moves the bristles over the step that :meth:`linearise` prepared."""
        moved = self._offset + self._slope * new_velocity
        self.deflection = np.minimum(np.maximum(moved, -1.0), 1.0)

    def reset(self) -> None:
        """Unbends every bristle."""
        self.deflection[:] = 0.0
