"""Huber's robust least squares on whitened rows: contacts and spikes weigh less (Huber 1981)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.stats import norm

from ident.estimators.fit import LinearFit, Stacked
from ident.estimators.least_squares import ErrorDeviation, joint_deviations, require_full_rank
from robots.arrays import FloatArray

_THRESHOLD = 1.345
"""95 % efficient where errors are normal."""

_STILL = 1e-8
_ITERATIONS = 200
_QUARTILE = float(norm.ppf(0.75))


@dataclass(frozen=True)
class RobustFit(LinearFit):
    """A linear fit with the weight that each row was given.

    Attributes:
        weights: (r,) 1 where a row is believed, below 1 where its residual is large.
    """

    weights: FloatArray = field(kw_only=True)

    def share_down_weighted(self) -> float:
        """Share of rows with a weight below 1."""
        return float(np.mean(self.weights < 1.0))


def huber_least_squares(
    stacked: Stacked,
    names: tuple[str, ...],
    kind: ErrorDeviation = "unbiased",
    threshold: float = _THRESHOLD,
) -> RobustFit:
    """Iteratively reweighted least squares: rows beyond ``threshold`` robust σ of their joint weigh less.

    The scale of each joint is its median absolute residual, so the joints are weighed against each other by
    what most of their rows say. Covariance: Huber's first proposal, s²(XᵀΩ⁻¹X)⁻¹ with the correction for b.

    Args:
        stacked: rows joint by joint.
        names: (b,) base parameter names, to say which cannot be seen.
        kind: how the first σ_j is estimated, see :func:`joint_deviations`.
        threshold: in robust σ.

    Raises:
        IdentificationError: the rows do not determine every parameter; the message names those.
    """
    scale = joint_deviations(stacked, kind)
    require_full_rank(stacked.x / stacked.spread(scale)[:, np.newaxis], names)
    weights = np.ones(stacked.y.size)
    beta = _solve(stacked, scale, weights)
    residual = stacked.y - stacked.x @ beta
    iteration, moved = 0, np.inf
    while moved >= _STILL and iteration < _ITERATIONS:
        iteration += 1
        scale = robust_deviations(stacked, residual)
        size = np.abs(residual) / stacked.spread(scale)
        weights = np.minimum(1.0, threshold / np.maximum(size, threshold))
        fresh = _solve(stacked, scale, weights)
        residual = stacked.y - stacked.x @ fresh
        moved = float(np.max(np.abs(fresh - beta)))
        beta = fresh
    covariance = _huber_covariance(stacked, residual, scale, threshold)
    whitened = stacked.x / stacked.spread(scale)[:, np.newaxis]
    return RobustFit(
        beta,
        covariance,
        scale,
        float(np.linalg.cond(whitened)),
        f"Huber's, {threshold:g} robust σ per joint, errors independent in time",
        iteration,
        moved < _STILL,
        weights=weights,
    )


def robust_deviations(stacked: Stacked, residual: FloatArray) -> FloatArray:
    """(n,) median |ε| of each joint over that of a standard normal variable."""
    return np.array([np.median(np.abs(part)) / _QUARTILE for part in stacked.split(residual)])


def _solve(stacked: Stacked, scale: FloatArray, weights: FloatArray) -> FloatArray:
    root = np.sqrt(weights) / stacked.spread(scale)
    return np.asarray(
        np.linalg.lstsq(stacked.x * root[:, np.newaxis], stacked.y * root, rcond=None)[0], dtype=np.float64
    )


def _huber_covariance(
    stacked: Stacked, residual: FloatArray, scale: FloatArray, threshold: float
) -> FloatArray:
    """k² Σψ²/(r − b) / m² · (XᵀΩ⁻¹X)⁻¹, ψ the clipped residual, m the share that is not clipped."""
    whitened = stacked.x / stacked.spread(scale)[:, np.newaxis]
    clipped = np.clip(residual / stacked.spread(scale), -threshold, threshold)
    inside = np.abs(clipped) < threshold
    rows, b = whitened.shape
    share = float(inside.mean())
    correction = 1.0 + b / rows * float(inside.var()) / share**2
    variance = correction**2 * float(clipped @ clipped) / (rows - b) / share**2
    return np.asarray(variance * np.linalg.inv(whitened.T @ whitened))
