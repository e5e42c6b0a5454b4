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


@dataclass(frozen=True)
class Onset:
    """Since which night, and how sure that is.

    Attributes:
        start: first night of the likeliest change.
        shape: of it.
        first, last: nights between which it began with 95 %.
        wear: probability that it grows, and is no step.
    """

    start: int
    shape: Shape
    first: int
    last: int
    wear: float


def find_change(series: FloatArray, day: FloatArray, warmth: Warmth | None, earliest: int) -> Onset:
    """When a change began, and whether it is a step or a ramp: the posterior over all of both.

    Beforehand step and ramp are as likely, and so is every night to begin with. The size of the change on the
    last night has a flat prior, the variance of a night 1/σ². With x the regressor of a change, all else
    taken out of it, the evidence is then |x|⁻¹ RSS^(−ν/2) (Smith, Biometrika 62, 1975).

    Args:
        series: (N,) one chart, at least two nights.
        day: (N,) increasing.
        warmth: that is taken out at the same time; None for none.
        earliest: first night that it may begin with, at least 1.
    """
    nights = series.size
    plain = np.ones((nights, 1)) if warmth is None else warmth.regressors()
    series = series if warmth is None else warmth.observed(series)
    basis, _ = np.linalg.qr(plain)
    left = series - basis @ (basis.T @ series)
    begins = [("step", start) for start in range(max(earliest, 1), nights)]
    grows = [("ramp", start) for start in range(max(earliest, 1), nights - _SHORTEST_RAMP + 1)]
    columns = np.zeros((series.size, len(begins) + len(grows)))
    for column, (shape, start) in zip(columns.T, begins + grows, strict=True):
        column[:nights] = change_shape(day, start, shape)  # type: ignore[arg-type]
    columns -= basis @ (basis.T @ columns)
    size = np.maximum(np.sum(columns**2, axis=0), _EMPTY)
    total = float(left @ left)
    rest = np.maximum(total - (left @ columns) ** 2 / size, _EMPTY * total + np.finfo(float).tiny)
    freedom = series.size - plain.shape[1] - 1
    share = np.repeat([1.0 / len(begins), 1.0 / max(len(grows), 1)], [len(begins), len(grows)])
    log = np.log(share) - np.log(size) / 2.0 - freedom * np.log(rest) / 2.0
    likely = np.exp(log - log.max())
    likely /= likely.sum()
    starts = np.array([start for _, start in begins + grows])
    until = np.cumsum(np.bincount(starts, likely, nights))
    best = int(np.argmax(likely))
    return Onset(
        int(starts[best]),
        "step" if best < len(begins) else "ramp",
        int(np.searchsorted(until, _TAIL)),
        min(int(np.searchsorted(until, 1.0 - _TAIL)), nights - 1),
        float(likely[len(begins) :].sum()),
    )


_SHORTEST_RAMP = 4
"""Nights below which a ramp is not told from a step."""
_EMPTY = 1e-9
_TAIL = 0.025
"""Probability of a beginning before, and after, the nights that are told."""
