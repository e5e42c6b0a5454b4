"""Sums of lagged products of residuals within recordings, over the samples that have no gap behind them."""

from __future__ import annotations

import numpy as np

from ident.ordered import distinct
from ident.statistics.whitening import (
    unbroken,
)
from robots.arrays import BoolArray, FloatArray, IntArray

_SAMPLES_AT_ONCE = 256
"""Samples whose products at all lags are summed while they stay in the cache."""
_COLUMNS_AT_ONCE = 16
"""Columns whose lagged products are summed together: bounds the memory."""


def lagged_products(
    one: FloatArray, other: FloatArray, segment: IntArray, used: BoolArray, largest: int
) -> FloatArray:
    """Σ over columns and samples of a_{t−k}·b_{t−l}, k, l = 0 … largest, where all these are used.

    Args:
        one, other: (samples,) or (samples, columns).
    """
    products = np.zeros((largest + 1, largest + 1))
    one, other = one.reshape(segment.size, -1), other.reshape(segment.size, -1)
    for name in distinct(segment):
        chosen = segment == name
        whole = unbroken(used[chosen], largest)
        if whole.all():
            products += _products_without_gaps(one[chosen], other[chosen], largest)
            continue
        for start in range(0, one.shape[1], _COLUMNS_AT_ONCE):
            part = slice(start, start + _COLUMNS_AT_ONCE)
            left = _lags(one[chosen, part], whole, largest)
            right = left if one is other else _lags(other[chosen, part], whole, largest)
            products += left.T @ right
    return products


def _products_without_gaps(one: FloatArray, other: FloatArray, largest: int) -> FloatArray:
    """The same where every sample counts: one row and column of sums, the others by what comes and goes."""
    last = one.shape[0]
    products = np.zeros((largest + 1, largest + 1))
    for begin in range(largest, last, _SAMPLES_AT_ONCE):
        end = min(begin + _SAMPLES_AT_ONCE, last)
        for lag in range(largest + 1):
            products[0, lag] += np.vdot(one[begin:end], other[begin - lag : end - lag])
            products[lag, 0] += np.vdot(one[begin - lag : end - lag], other[begin:end])
    products[0, 0] /= 2.0
    before, after = slice(largest - 1, None, -1), slice(last - 1, last - largest - 1, -1)
    change = one[before][:largest] @ other[before][:largest].T - one[after] @ other[after].T
    for k in range(largest):
        products[k + 1, 1:] = products[k, :-1] + change[k]
    return products


def _lags(columns: FloatArray, whole: BoolArray, largest: int) -> FloatArray:
    """(samples · columns, largest + 1): each sample that counts, and those before it, nearest first."""
    last = columns.shape[0]
    return np.stack([columns[largest - k : last - k][whole].ravel() for k in range(largest + 1)], axis=1)


def samples_without_gap(segment: IntArray, used: BoolArray, largest: int) -> int:
    return sum(int(unbroken(used[segment == name], largest).sum()) for name in distinct(segment))
