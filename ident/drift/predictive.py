"""Each night beside what prior and clean nights before make of it: scores that are standard normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr, ndtri_exp

from robots.arrays import BoolArray, FloatArray

_FACTOR = np.linspace(-6.0, 2.5, 35)
"""Logarithm of an arm's run-to-run deviation beside its prior."""
_MORE, _LESS = 0.45, 1.5
"""Deviations of that logarithm, upwards and downwards: the prior is a poor arm, many are far steadier."""
_LOW, _HIGH = 0.05, 0.95


@dataclass(frozen=True)
class ChartPrior:
    """What is known of each chart before there are nights.

    Attributes:
        sigma: (c,) deviation of a night on a poor arm, that within a run included.
        least: (c,) share of it below which no nights bring the deviation: 1 where a few weeks do not show
            what a year holds.
        slope, slope_sigma: (c,) change per kelvin and its deviation; zeros where there is no temperature.
    """

    sigma: FloatArray
    least: FloatArray
    slope: FloatArray
    slope_sigma: FloatArray


@dataclass(frozen=True)
class Predicted:
    """Nights beside their predictions.

    Attributes:
        scores: (N, c) standard normal where nothing changes; nan on the first night.
        error: (N, c) observed less predicted, in the chart's unit.
        prior_sigma: (c,) median of the deviation of a night before there were nights.
        sigma: (c,) posterior median of it.
        interval: (2, c) its 5 % and 95 % points.
        slope, slope_sigma: (c,) posterior of the change per kelvin.
        last: the mixture of normals that the last night was predicted by.
    """

    scores: FloatArray
    error: FloatArray
    prior_sigma: FloatArray
    sigma: FloatArray
    interval: FloatArray
    slope: FloatArray
    slope_sigma: FloatArray
    last: Mixture

    def allowed(self, score: float) -> FloatArray:
        """(c,) how far the last night may be above its prediction before its score exceeds the one given."""
        middle = self.last.centre()
        low, high = np.zeros(middle.size), 40.0 * self.last.sigma[:, -1]
        for _ in range(60):
            half = 0.5 * (low + high)
            beyond = self.last.score(middle + half) > score
            low, high = np.where(beyond, low, half), np.where(beyond, half, high)
        return np.asarray(0.5 * (low + high))


@dataclass(frozen=True)
class Mixture:
    """Normals with weights, (c, g) each."""

    mean: FloatArray
    sigma: FloatArray
    weights: FloatArray

    def centre(self) -> FloatArray:
        """(c,) mean."""
        return np.asarray((self.weights * self.mean).sum(axis=1))

    def score(self, values: FloatArray) -> FloatArray:
        """(c,) standard normal of values (c,) drawn from the mixture, far out as well."""
        above = values > self.centre()
        with np.errstate(divide="ignore"):
            weights = np.log(self.weights)
        distance = (values[:, np.newaxis] - self.mean) / self.sigma
        logs = weights + log_ndtr(np.where(above[:, np.newaxis], -distance, distance))
        most = logs.max(axis=1)
        tail = most + np.log(np.exp(logs - most[:, np.newaxis]).sum(axis=1))
        return np.asarray(np.where(above, -1.0, 1.0) * ndtri_exp(tail))


def predict(series: FloatArray, celsius: FloatArray | None, clean: BoolArray, prior: ChartPrior) -> Predicted:
    """One-step predictions of every night, from the second one on.

    A night is mean + slope × temperature + σ × normal. The mean is unknown, the slope has a normal prior, the
    logarithm of σ has one too and is integrated over a grid, weighted by how likely it makes the nights so
    far, each beside those before it (Dawid 1984). One clean night is enough to begin with; many make the
    prior forgotten.

    Args:
        series: (N, c) one chart a column.
        celsius: (N, c) its temperature; None where there is none.
        clean: (N,) nights that teach.
        prior: of each chart.
    """
    nights = len(series)
    warm = np.zeros(series.shape) if celsius is None else celsius - celsius[0]
    grid = prior.sigma[:, np.newaxis] * np.maximum(np.exp(_FACTOR), prior.least[:, np.newaxis])
    likely = np.broadcast_to(-0.5 * (_FACTOR / np.where(_FACTOR > 0.0, _MORE, _LESS)) ** 2, grid.shape)
    sums = _Sums.of(series[0], warm[0])
    scores, error = np.full(series.shape, np.nan), np.full(series.shape, np.nan)
    weights = first = _normalised(likely)
    line = _line(sums, prior, grid)
    last = line.night(warm[0], weights)
    for k in range(1, nights):
        last = line.night(warm[k], weights)
        error[k] = series[k] - last.centre()
        scores[k] = last.score(series[k])
        if k < nights - 1 and clean[k]:
            apart = (series[k, :, np.newaxis] - last.mean) / last.sigma
            likely = likely - 0.5 * apart**2 - np.log(last.sigma)
            weights = _normalised(likely)
            sums = sums.with_night(series[k], warm[k])
            line = _line(sums, prior, grid)
    slope = (weights * line.slope).sum(axis=1)
    spread = (weights * (line.steep + (line.slope - slope[:, np.newaxis]) ** 2)).sum(axis=1)
    points = _points(weights, grid)
    return Predicted(
        scores, error, _points(first, grid)[1], points[1], points[[0, 2]], slope, np.sqrt(spread), last
    )


@dataclass(frozen=True)
class _Sums:
    """(c,) sums over the clean nights so far: number, temperature, its square, the series, their product."""

    n: float
    t: FloatArray
    tt: FloatArray
    y: FloatArray
    ty: FloatArray

    @classmethod
    def of(cls, y: FloatArray, t: FloatArray) -> _Sums:
        return cls(1.0, t, t**2, y, t * y)

    def with_night(self, y: FloatArray, t: FloatArray) -> _Sums:
        return _Sums(self.n + 1.0, self.t + t, self.tt + t**2, self.y + y, self.ty + t * y)


@dataclass(frozen=True)
class _Line:
    """Posterior of the line for each σ of the grid, (c, g) but for ``apart`` (c, 1).

    Attributes:
        apart: mean temperature of the nights so far.
        mean: at that temperature.
        slope: mean of its posterior.
        steep: variance of the slope.
        grid: σ of a night.
        n: nights so far.
    """

    apart: FloatArray
    mean: FloatArray
    slope: FloatArray
    steep: FloatArray
    grid: FloatArray
    n: float

    def night(self, warm: FloatArray, weights: FloatArray) -> Mixture:
        """What a night at a temperature (c,) is predicted to be."""
        away = warm[:, np.newaxis] - self.apart
        variance = self.grid**2 * (1.0 + 1.0 / self.n) + away**2 * self.steep
        return Mixture(self.mean + self.slope * away, np.sqrt(variance), weights)


def _line(sums: _Sums, prior: ChartPrior, grid: FloatArray) -> _Line:
    """Bayesian regression with a flat prior on the mean and a normal one on the slope."""
    known = (prior.slope_sigma > 0.0)[:, np.newaxis]
    variance = np.where(known, prior.slope_sigma[:, np.newaxis] ** 2, 1.0)
    centred = (sums.tt - sums.t**2 / sums.n)[:, np.newaxis]
    about = (sums.ty - sums.t * sums.y / sums.n)[:, np.newaxis]
    precision = centred / grid**2 + 1.0 / variance
    expected = prior.slope[:, np.newaxis]
    slope = np.where(known, (about / grid**2 + expected / variance) / precision, expected)
    steep = np.where(known, 1.0 / precision, 0.0)
    apart, mean = (sums.t / sums.n)[:, np.newaxis], (sums.y / sums.n)[:, np.newaxis]
    return _Line(apart, np.broadcast_to(mean, grid.shape), slope, steep, grid, sums.n)


def _normalised(likely: FloatArray) -> FloatArray:
    found = np.exp(likely - likely.max(axis=1, keepdims=True))
    return np.asarray(found / found.sum(axis=1, keepdims=True))


def _points(weights: FloatArray, grid: FloatArray) -> FloatArray:
    """(3, c) 5 %, 50 % and 95 % points, between those of the grid too."""
    sums = np.cumsum(weights, axis=1) - 0.5 * weights
    levels = (_LOW, 0.5, _HIGH)
    found = [np.exp(np.interp(levels, own, np.log(line))) for own, line in zip(sums, grid, strict=True)]
    return np.array(found).T
