"""Disturbances of the plant and its encoders, each an object with its own random stream."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray


def stream(seed: int, run: int, purpose: int) -> np.random.Generator:
    """The random stream of one purpose in one run; streams of different purposes are independent."""
    return np.random.default_rng(np.random.SeedSequence([seed, run, purpose]))


class TorqueNoise:
    """Process torque at the drive outputs: white at the plant step, or first-order coloured.

    Args:
        deviation: standard deviation per axis, (n,), N·m; the same for white and coloured noise.
        time_constant: s; 0 for white noise.
        step: plant step, s.
    """

    def __init__(self, deviation: FloatArray, time_constant: float, step: float) -> None:
        self._deviation = np.array(deviation, dtype=np.float64)
        self._memory = float(np.exp(-step / time_constant)) if time_constant > 0 else 0.0
        self._level = np.zeros_like(self._deviation)
        self._silent = not self._deviation.any()
        if self._memory > 0.0:
            # Most arms have white noise, and this import takes longer than everything else of their process.
            from scipy.signal import lfilter

            self._filter = lfilter

    def block(self, rng: np.random.Generator, steps: int) -> FloatArray:
        """The torques of the next plant steps, (steps, n), N·m."""
        n = self._deviation.size
        if self._silent:
            return np.zeros((steps, n))
        white = rng.standard_normal((steps, n)) * self._deviation
        if self._memory == 0.0:
            return white
        fresh = np.sqrt(1.0 - self._memory**2)
        start = (self._memory * self._level)[None, :]
        coloured, _ = self._filter([1.0], [1.0, -self._memory], fresh * white, axis=0, zi=start)
        self._level = np.array(coloured[-1])
        return np.asarray(coloured)

    def reset(self) -> None:
        """Forgets the colour's state."""
        self._level = np.zeros_like(self._deviation)


class Encoder:
    """Absolute encoders at the drive outputs: additive noise, then rounding to counts.

    Args:
        counts_per_unit: signed counts per rad (or m) of drive output, (n,).
        deviation: standard deviation of the noise before rounding, (n,), rad or m.
    """

    def __init__(self, counts_per_unit: FloatArray, deviation: FloatArray) -> None:
        self.counts_per_unit = np.array(counts_per_unit, dtype=np.float64)
        self._deviation_counts = np.abs(self.counts_per_unit) * deviation

    def block(self, rng: np.random.Generator, samples: int) -> FloatArray:
        """Reading errors of the next samples, (samples, n), in counts."""
        n = self.counts_per_unit.size
        return rng.standard_normal((samples, n)) * self._deviation_counts

    def read(self, position: FloatArray, error: FloatArray) -> FloatArray:
        """Counts (whole numbers as floats) for drive output positions, (n,)."""
        return np.rint(position * self.counts_per_unit + error)
