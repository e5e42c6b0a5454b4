"""How much an arm differs from one night to the next, temperature taken into account."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from robots.arrays import BoolArray, FloatArray

_FACTOR_STEPS = 10
_OWN_SHARE = 0.05
"""A parameter keeps at least this share of its run-to-run variance to itself."""
_SPREAD = 1e-9
"""A temperature that varies by less than this (K) is a constant."""


@dataclass(frozen=True)
class Recursive:
    """One-step prediction errors: each night beside what the clean nights before it make of its temperature.

    Attributes:
        error: (N, c) observed less predicted, over √(1 + leverage): of equal variance night by night.
        scale: (N, c) their standard deviation as the nights before show it; nan where there are too few.
        df: (N,) degrees of freedom of the scale.
        leverage: (N,) of the night's temperature among those before.
    """

    error: FloatArray
    scale: FloatArray
    df: FloatArray
    leverage: FloatArray


def recursive_residuals(series: FloatArray, celsius: FloatArray | None, clean: BoolArray) -> Recursive:
    """Recursive residuals (Brown, Durbin and Evans 1975) of series regressed on temperature.

    Where the series are normal and nothing changes, error/scale has Student's distribution with ``df``
    degrees of freedom, independently from night to night, however large the run-to-run variance is.

    Args:
        series: (N, c).
        celsius: (N,) temperature; None for a constant mean.
        clean: (N,) nights that later ones are compared with.
    """
    nights = series.shape[0]
    design = _design(celsius, nights)
    origin = series[np.argmax(clean)] if clean.any() else series[0]
    y = series - origin
    taken = clean[:, np.newaxis]
    outer = _before(design[:, :, np.newaxis] * design[:, np.newaxis, :] * clean[:, np.newaxis, np.newaxis])
    cross = _before(design[:, :, np.newaxis] * (y * taken)[:, np.newaxis, :])
    squares = _before(y**2 * taken)
    count = np.concatenate([[0], np.cumsum(clean)[:-1]])
    error = np.full(series.shape, np.nan)
    scale = np.full(series.shape, np.nan)
    leverage, df = np.full(nights, np.nan), np.zeros(nights)
    size = design.shape[1]
    for k in np.flatnonzero(count > size):
        slopes = np.linalg.pinv(outer[k], hermitian=True)
        fit = slopes @ cross[k]
        leverage[k] = design[k] @ slopes @ design[k]
        error[k] = (y[k] - design[k] @ fit) / np.sqrt(1.0 + leverage[k])
        df[k] = count[k] - size
        left = squares[k] - np.einsum("pc,pc->c", cross[k], fit)
        scale[k] = np.sqrt(np.maximum(left, 1e-12 * squares[k]) / df[k])
    return Recursive(error, scale, df, leverage)


def run_to_run_covariance(values: FloatArray, within: FloatArray, celsius: FloatArray | None) -> FloatArray:
    """Covariance (b, b) between runs beyond that within them: what moves together, and each parameter's own.

    Principal factors: directions in which the nights differ by more than chance makes of independent
    parameters (the edge of Marchenko and Pastur 1967), e.g. all friction with warmth that no sensor saw; what
    they leave of each parameter's variance is its own.

    Args:
        values: (N, b) parameters of clean nights.
        within: (b, b) mean covariance within the runs.
        celsius: (N,) temperature that the values are regressed on; None for a constant mean.
    """
    nights, size = values.shape
    design = _design(celsius, nights)
    centred = values - values.mean(axis=0)
    left = centred - design @ np.linalg.lstsq(design, centred, rcond=None)[0]
    df = nights - design.shape[1]
    beyond = np.maximum((left**2).sum(axis=0) / df - np.diag(within), 0.0)
    edge = (1.0 + np.sqrt(size / df)) ** 2
    own, common = beyond, np.zeros((size, size))
    for _ in range(_FACTOR_STEPS):
        factor = np.linalg.cholesky(within + np.diag(own))
        white = solve_triangular(factor, left.T, lower=True)
        vectors, singular, _ = np.linalg.svd(white, full_matrices=False)
        extra = np.where(singular**2 / df > edge, singular**2 / df - 1.0, 0.0)
        loadings = factor @ (vectors * np.sqrt(extra))
        common = loadings @ loadings.T
        own = np.maximum(beyond - np.diag(common), _OWN_SHARE * beyond)
    return np.asarray(common + np.diag(own))


def temperature_slopes(
    values: FloatArray, celsius: FloatArray | None, prior: FloatArray, weight: float
) -> FloatArray:
    """Change (b,) of the parameters per kelvin over clean nights, drawn towards the prior.

    Args:
        values: (N, b).
        celsius: (N,); None gives zeros.
        prior: (b,) mean change per kelvin before there are nights.
        weight: sum of squares of temperature, K², that the prior counts as.
    """
    if celsius is None:
        return np.zeros(values.shape[1])
    apart = celsius - celsius.mean()
    about = apart @ (values - values.mean(axis=0))
    return np.asarray((about + weight * prior) / (apart @ apart + weight))


def _design(celsius: FloatArray | None, nights: int) -> FloatArray:
    if celsius is None or np.ptp(celsius) < _SPREAD:
        return np.ones((nights, 1))
    return np.column_stack([np.ones(nights), celsius - celsius.mean()])


def _before(terms: FloatArray) -> FloatArray:
    """Sums over the nights before each."""
    return np.concatenate([np.zeros_like(terms[:1]), np.cumsum(terms, axis=0)[:-1]])
