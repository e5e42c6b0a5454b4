"""Probabilities of the far ends of distributions.

By ``scipy.special``, and only where it is needed: the objects of ``scipy.stats`` say the same and take longer
to load than a log takes to be identified.
"""

from __future__ import annotations

import math

import numpy as np

from robots.arrays import FloatArray


def beyond_chi2(statistic: float, freedom: float) -> float:
    """Probability that a χ² with so many degrees of freedom is larger.

    Of whole degrees Q(a + 1, x) = Q(a, x) + xᵃ e⁻ˣ / Γ(a + 1), from Q(½, x) = erfc √x or Q(1, x) = e⁻ˣ on.
    """
    x = 0.5 * max(statistic, 0.0)
    if freedom != int(freedom):
        from scipy.special import chdtrc

        return float(chdtrc(freedom, 2.0 * x))
    a = 1.0 if freedom % 2 == 0 else 0.5
    found = math.exp(-x) if a == 1.0 else math.erfc(math.sqrt(x))
    while x > 0.0 and a < 0.5 * freedom:
        found += math.exp(a * math.log(x) - x - math.lgamma(a + 1.0))
        a += 1.0
    return min(found, 1.0) if x > 0.0 else 1.0


def beyond_f(statistic: float, freedom: float, of_denominator: float) -> float:
    """Probability that an F with these degrees of freedom is larger."""
    from scipy.special import fdtrc

    return float(fdtrc(freedom, of_denominator, max(statistic, 0.0)))


def each_beyond_f(statistics: FloatArray, freedom: float, of_denominator: float) -> FloatArray:
    """The same of each of several statistics."""
    from scipy.special import fdtrc

    return np.asarray(fdtrc(freedom, of_denominator, np.maximum(statistics, 0.0)))
