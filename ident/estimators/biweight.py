"""Tukey's biweight: rows far off do not count at all (Beaton and Tukey 1974)."""

from __future__ import annotations

import numpy as np

from ident.estimators.huber import HUBER
from ident.estimators.robust import MEstimator
from robots.arrays import FloatArray

THRESHOLD = 4.685
"""Robust σ; 95 % efficient where errors are normal."""


def _squared(u: FloatArray) -> FloatArray:
    return np.asarray(np.minimum((u / THRESHOLD) ** 2, 1.0))


def _weight(u: FloatArray) -> FloatArray:
    return np.asarray((1.0 - _squared(u)) ** 2)


def _slope(u: FloatArray) -> FloatArray:
    share = _squared(u)
    return np.asarray((1.0 - share) * (1.0 - 5.0 * share))


BIWEIGHT = MEstimator(
    "biweight",
    "least squares with Tukey's biweight",
    "Biweight",
    f"Tukey's biweight, {THRESHOLD:g}",
    _weight,
    _slope,
    start=HUBER,
)
