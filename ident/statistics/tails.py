"""Probabilities of the far ends of distributions.

By ``scipy.special``: the objects of ``scipy.stats`` say the same and take longer to load than a log takes to
be identified.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc, fdtrc

from robots.arrays import FloatArray


def beyond_chi2(statistic: float, freedom: float) -> float:
    """Probability that a χ² with so many degrees of freedom is larger."""
    return float(chdtrc(freedom, max(statistic, 0.0)))


def beyond_f(statistic: float, freedom: float, of_denominator: float) -> float:
    """Probability that an F with these degrees of freedom is larger."""
    return float(fdtrc(freedom, of_denominator, max(statistic, 0.0)))


def each_beyond_f(statistics: FloatArray, freedom: float, of_denominator: float) -> FloatArray:
    """The same of each of several statistics."""
    return np.asarray(fdtrc(freedom, of_denominator, np.maximum(statistics, 0.0)))
