"""Heat in a gear: a first-order store, for columns and for the simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.filters import recursion
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Warming:
    """Heat that friction leaves in its gear: a first-order store, which takes it in and gives it off.

    Warmth w in W: T dw/dt = P − w with P = (dry + viscous·|speed|)·|speed|, so w is the power that would hold
    the gear as warm as it is. It is zero where the recording's time is zero; a recording that begins later
    follows motions like its own.

    Attributes:
        time_constant: T, s.
        dry, viscous: of the friction that heats, N·m and N·m·s/rad (or N and N·s/m).
    """

    time_constant: float
    dry: float
    viscous: float

    def warmth(self, speed: FloatArray, time: FloatArray | None) -> FloatArray:
        """(samples,) W of speeds (samples,) at evenly spaced times; zero where no time is known."""
        return warmed(self._heat(speed), time, self.time_constant)

    def at_start(self, speed: FloatArray, elapsed: float) -> float:
        """W after so many seconds of motions like one with these speeds (samples,)."""
        return _warm_before(self._heat(speed), elapsed, self.time_constant)

    def kept(self, seconds: float) -> float:
        """Share of a warmth that is left after some time."""
        return float(np.exp(-seconds / self.time_constant))

    def _heat(self, speed: FloatArray) -> FloatArray:
        size = np.abs(speed)
        return np.asarray((self.dry + self.viscous * size) * size)


def warmed(heat: FloatArray, time: FloatArray | None, time_constant: float) -> FloatArray:
    """What a first-order store holds of heat (samples,) that comes in at evenly spaced times: (samples,).

    Nothing at time zero, and nothing where no time is known. The unit is that of the heat.
    """
    if time is None:
        return np.zeros_like(heat)
    start = _warm_before(heat, float(time[0]), time_constant)
    if time.shape[0] < 2:
        return np.full_like(heat, start)
    kept = float(np.exp(-(time[1] - time[0]) / time_constant))
    driven = np.concatenate([[start], (1.0 - kept) * heat[:-1]])
    return recursion(np.array([1.0, -kept]), driven)


def _warm_before(heat: FloatArray, elapsed: float, time_constant: float) -> float:
    return float(np.mean(heat) * -np.expm1(-max(elapsed, 0.0) / time_constant))
