"""Since when: the night from which a step or a ramp fits a chart best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.drift.values import Shape
from robots.arrays import FloatArray


def change_shape(day: FloatArray, start: int, shape: Shape) -> FloatArray:
    """(N,) regressor of a change that begins at night ``start`` and is 1 on the last night."""
    if shape == "step":
        return (np.arange(day.size) >= start).astype(np.float64)
    since = np.maximum(day - day[start - 1], 0.0)
    return np.asarray(since / since[-1])


@dataclass(frozen=True)
class Warmth:
    """Temperature that is taken out together with a change.

    Attributes:
        celsius: (N,).
        slope: change per kelvin before there are nights: a scalar, or (c,) of several series.
        weight: sum of squares of temperature, K², that it counts as.
    """

    celsius: FloatArray
    slope: FloatArray
    weight: float

    def regressors(self) -> FloatArray:
        """(N + 1, 2): mean and temperature; the last row is the prior's."""
        apart = self.celsius - self.celsius.mean()
        last = np.array([0.0, np.sqrt(self.weight)])
        return np.vstack([np.column_stack([np.ones(apart.size), apart]), last])

    def observed(self, series: FloatArray) -> FloatArray:
        """(N + 1, …) the series with what the prior says last."""
        return np.concatenate([series, np.sqrt(self.weight) * np.asarray(self.slope)[np.newaxis]])


def find_change(
    series: FloatArray, day: FloatArray, warmth: Warmth | None, earliest: int
) -> tuple[int, Shape]:
    """First night of the change, and whether it is a step or a ramp: least squares over all of both.

    Args:
        series: (N,) one chart.
        day: (N,) increasing.
        warmth: that is taken out at the same time; None for none.
        earliest: first night that it may begin with, at least 1.
    """
    nights = series.size
    plain = np.ones((nights, 1)) if warmth is None else warmth.regressors()
    series = series if warmth is None else warmth.observed(series)
    basis, _ = np.linalg.qr(plain)
    left = series - basis @ (basis.T @ series)
    best: tuple[float, int, Shape] = (-1.0, nights - 1, "step")
    for shape in ("step", "ramp"):
        for start in range(max(earliest, 1), nights):
            if shape == "ramp" and nights - start < _SHORTEST_RAMP:
                break
            column = np.zeros(series.size)
            column[:nights] = change_shape(day, start, shape)
            column = column - basis @ (basis.T @ column)
            size = float(column @ column)
            gain = float(column @ left) ** 2 / size if size > _EMPTY else 0.0
            if gain > best[0] * (1.0 + _PREFERENCE):
                best = (gain, start, shape)
    return best[1], best[2]


_SHORTEST_RAMP = 4
"""Nights below which a ramp is not told from a step."""
_EMPTY = 1e-9
_PREFERENCE = 1e-6
"""A step comes first: a ramp has to explain more."""
