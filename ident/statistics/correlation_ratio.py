"""How much of one quantity goes with another, whatever the form of its course."""

from __future__ import annotations

import numpy as np

from ident.ordered import distinct, quantiles
from robots.arrays import FloatArray

_BINS = 24


def correlation_ratio(quantity: FloatArray, values: FloatArray, most: int = _BINS) -> float:
    """Share of the variance of values (samples,) between ``most`` bins of a quantity, adjusted for chance."""
    if not values.size:
        return 0.0
    edges = distinct(quantiles(quantity, np.linspace(0.0, 1.0, most + 1)))
    bins = np.clip(np.searchsorted(edges, quantity, side="right") - 1, 0, max(edges.size - 2, 0))
    count = np.bincount(bins)
    total = np.bincount(bins, values)
    used = count > 0
    mean = values.mean()
    between = float(np.sum(count[used] * (total[used] / count[used] - mean) ** 2))
    whole = float(np.sum((values - mean) ** 2))
    groups = int(used.sum())
    if whole == 0.0 or values.size <= groups:
        return 0.0
    ratio = between / whole
    return max(0.0, 1.0 - (1.0 - ratio) * (values.size - 1) / (values.size - groups))
