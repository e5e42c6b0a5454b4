"""Finite Fourier series per joint (Swevers et al. 1997): periodic, band-limited, exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robots.arrays import FloatArray
from trajectories.motions.motion import Extremes, MotionState

GRID_PER_HARMONIC = 64
"""Points per period of the highest harmonic at which extremes are looked for."""


@dataclass(frozen=True)
class FourierMotion:
    """q(t) = offset + Σ_k sine_k sin(kω(t + begin)) + cosine_k cos(kω(t + begin)), ω = 2π / period.

    Attributes:
        period: s.
        periods: how many.
        offset: (n,).
        sine, cosine: harmonics × joints, rad (or m).
        begin: where in the period the motion begins, s.
    """

    period: float
    periods: int
    offset: FloatArray
    sine: FloatArray
    cosine: FloatArray
    begin: float = 0.0

    @property
    def duration(self) -> float:
        return self.period * self.periods

    @property
    def joints(self) -> int:
        return len(self.offset)

    @property
    def frequencies(self) -> FloatArray:
        """kω of each harmonic, rad/s."""
        return np.asarray(2 * np.pi / self.period * np.arange(1, len(self.sine) + 1), dtype=np.float64)

    def at(self, time: FloatArray) -> MotionState:
        """The exact state; the motion is periodic, so any time is allowed."""
        frequencies = self.frequencies
        since = np.atleast_1d(np.asarray(time, dtype=np.float64)) + self.begin
        angle = since[:, np.newaxis] * frequencies
        derivatives = []
        sine, cosine = self.sine, self.cosine
        for _ in range(4):
            derivatives.append(np.sin(angle) @ sine + np.cos(angle) @ cosine)
            sine, cosine = -frequencies[:, np.newaxis] * cosine, frequencies[:, np.newaxis] * sine
        return MotionState(self.offset + derivatives[0], *derivatives[1:])

    def breaks(self) -> FloatArray:
        return np.array([0.0, self.duration])

    def extremes(self) -> Extremes:
        """Values on a fine grid plus what a curve of this bandwidth can rise between two grid points.

        Between points h apart a function is at most h²/8 · max|f″| above the larger of the two, and the
        second derivative of a series is at most the sum of its amplitudes times (kω)².
        """
        count = GRID_PER_HARMONIC * len(self.sine)
        time = np.asarray(np.arange(count) * (self.period / count), dtype=np.float64)
        # Counted from the series' own zero: where the motion begins does not change its extremes.
        state = self.at(time - self.begin)
        time = (time - self.begin) % self.period
        amplitude = np.hypot(self.sine, self.cosine)
        frequencies = self.frequencies[:, np.newaxis]
        rise = [
            (self.period / count) ** 2 / 8 * (amplitude * frequencies ** (order + 2)).sum(axis=0)
            for order in range(4)
        ]
        speed, acceleration, jerk = (np.abs(x) for x in (state.velocity, state.acceleration, state.jerk))
        return Extremes(
            state.position.min(axis=0) - rise[0],
            state.position.max(axis=0) + rise[0],
            speed.max(axis=0) + rise[1],
            acceleration.max(axis=0) + rise[2],
            jerk.max(axis=0) + rise[3],
            time[state.position.argmin(axis=0)],
            time[state.position.argmax(axis=0)],
            time[speed.argmax(axis=0)],
            time[acceleration.argmax(axis=0)],
            time[jerk.argmax(axis=0)],
        )

    def begun(self, time: float) -> FourierMotion:
        """The same periodic motion begun ``time`` s later."""
        return replace(self, begin=self.begin + time)

    def once(self) -> FourierMotion:
        """One period of it."""
        return replace(self, periods=1)

    def smaller(self, share: float) -> FourierMotion:
        """The same about the same offset, with a share of the amplitudes."""
        return replace(self, sine=share * self.sine, cosine=share * self.cosine)
