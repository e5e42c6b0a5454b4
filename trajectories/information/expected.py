"""What the base parameters are expected to be, and what %σ that lets one expect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray

_HALVINGS = 60


@dataclass(frozen=True, eq=False)
class ExpectedValues:
    """Values of the base parameters from before, and how well they are known.

    Attributes:
        value: (b,) SI.
        sigma: (b,) standard deviation of each; 0 where it is taken for exact.
    """

    value: FloatArray
    sigma: FloatArray

    @classmethod
    def described(cls, base: BaseParameters) -> ExpectedValues:
        """The a-priori figures of the arm's description, taken for exact."""
        value = base.regroup(base.model.prior())
        return cls(value, np.zeros_like(value))

    def percent_sigma(self, sigma: FloatArray) -> FloatArray:
        """What identification will print for estimates of deviations ``sigma`` (b,), even odds either way.

        It prints 100·σ/|β̂| with its own estimate β̂, which scatters about the true value as the value from
        before did. So |β̂| is expected at the median of |N(value, σ² + sigma²)|: about |value| where a
        parameter is well seen, and about 0.67 deviations where it drowns.

        Returns:
            (b,) %; inf where the value is exactly 0, which means that nothing was known of it.
        """
        spread = np.sqrt(np.where(np.isfinite(sigma), sigma, 0.0) ** 2 + self.sigma**2)
        size = median_size(np.abs(self.value), spread)
        with np.errstate(divide="ignore", invalid="ignore"):
            percent = 100.0 * sigma / size
        return np.asarray(np.where((self.value == 0.0) & (self.sigma == 0.0), np.inf, percent))


def median_size(mean: FloatArray, sigma: FloatArray) -> FloatArray:
    """Median of |x| for normal x with mean ≥ 0 and standard deviation, all (b,)."""
    low, high = np.zeros_like(mean), mean + sigma
    unit = np.where(sigma > 0.0, sigma, 1.0)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        below = ndtr((middle - mean) / unit) - ndtr((-middle - mean) / unit) < 0.5
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.where(sigma > 0.0, (low + high) / 2, mean)
