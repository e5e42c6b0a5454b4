"""Percentiles and distinct values by one sort: NumPy's load its masked arrays, as long as a log is read."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from robots.arrays import FloatArray

Number = TypeVar("Number", bound=np.generic)


def quantiles(values: FloatArray, shares: FloatArray) -> FloatArray:
    """Of values (samples,), as of :func:`percentile`, one for each share from 0 to 1."""
    ordered = np.sort(values)
    if np.isnan(ordered[-1:]).any():
        return np.full(shares.shape, np.nan)
    return np.interp(shares * (values.size - 1), np.arange(values.size), ordered)


def percentile(values: NDArray[Number], share: float) -> FloatArray:
    """What ``share`` % of the values are not above, along the first axis, in proportion between two."""
    if not len(values):
        return np.full(values.shape[1:], np.nan)
    place = 0.01 * share * (len(values) - 1)
    below = int(place)
    above = min(below + 1, len(values) - 1)
    ordered = np.partition(values, (below, above, len(values) - 1), axis=0)
    found = np.asarray(ordered[below] + (place - below) * (ordered[above] - ordered[below]), dtype=np.float64)
    return np.where(ordered[-1] == ordered[-1], found, np.nan)  # what is no number stands last


def median(values: NDArray[Number]) -> float:
    """Of all values."""
    return float(percentile(values.ravel(), 50.0))


def distinct(values: NDArray[Number]) -> NDArray[Number]:
    """Each value once, in order."""
    ordered = np.sort(values, axis=None)
    new = np.ones(ordered.size, dtype=np.bool_)
    np.not_equal(ordered[1:], ordered[:-1], out=new[1:])
    return ordered[new]
