"""Huber's estimator: residuals beyond a threshold count as if they lay on it (Huber 1981)."""

from __future__ import annotations

import numpy as np

from ident.estimators.robust import MEstimator
from robots.arrays import FloatArray

THRESHOLD = 1.345
"""Robust σ; 95 % efficient where errors are normal."""


def huber(threshold: float = THRESHOLD) -> MEstimator:
    """Huber's estimator with a threshold in robust σ."""

    def weight(u: FloatArray) -> FloatArray:
        return np.asarray(np.minimum(1.0, threshold / np.maximum(np.abs(u), threshold)))

    def slope(u: FloatArray) -> FloatArray:
        return np.asarray((np.abs(u) < threshold).astype(np.float64))

    return MEstimator("robust", "robust least squares", "Robust", f"Huber's, {threshold:g}", weight, slope)


HUBER = huber()
