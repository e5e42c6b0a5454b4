"""The sign of a speed as friction sees it: exact, or smooth so that it does not chatter at standstill."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from robots.arrays import FloatArray


@dataclass(frozen=True)
class FrictionSign:
    """``sign(q̇)`` or ``tanh(q̇/width)``; the same form in the regressor and in the simulation.

    Attributes:
        kind: which.
        width: speed in rad/s (or m/s) at which the smooth form saturates; unused by ``sign``.
    """

    kind: Literal["sign", "tanh"]
    width: float

    def __call__(self, velocity: FloatArray) -> FloatArray:
        """Values in [−1, 1] in the shape of ``velocity`` (rad/s or m/s)."""
        if self.kind == "sign":
            return np.sign(velocity)
        return np.tanh(velocity / self.width)
