"""Covariance of linear estimates when errors are correlated along time (method.md 5.3).

``block`` is the paper's: errors independent from row to row, one deviation per joint. ``ar`` keeps the
same estimate and lets each joint's error be the AR process that its residual shows, so that σ is not
too small where residuals are correlated.
"""

from __future__ import annotations

import numpy as np

from ident.filters import recursion
from ident.ordered import distinct
from ident.statistics.symmetric import eigen_of
from ident.statistics.toeplitz import spectrum, times
from ident.statistics.triangle import weighted_product
from ident.statistics.whitening import Whitening
from robots.arrays import BoolArray, FloatArray, IntArray

_NEGLIGIBLE = 1e-6
"""An AR process's impulse response is cut where it has decayed to this."""


def weighted_score_covariance(
    instruments: FloatArray,
    sigma: FloatArray,
    whitening: Whitening,
    segment: IntArray,
    used: BoolArray | None = None,
) -> FloatArray:
    """Covariance (b, b) of ZᵀΩ⁻¹ε: Σ_j Z_jᵀ Γ_j Z_j / σ_j⁴, with Γ_j the errors' autocovariance.

    Args:
        instruments: samples × joints × b.
        sigma: (n,) the deviations that make Ω.
        whitening: the AR process per joint.
        segment: (samples,) recordings; errors of different ones are independent.
        used: samples × joints, false where a row is left out; all are used where None.
    """
    total = np.zeros((instruments.shape[2], instruments.shape[2]))
    for joint, coefficients in enumerate(whitening.coefficients):
        for index in distinct(segment):
            own = segment == index
            z = instruments[own, joint] / sigma[joint] ** 2
            if used is not None:
                z *= used[own, joint, np.newaxis]
            seen = np.flatnonzero(z.any(axis=0))  # half of the columns of an arm know nothing of a joint
            z = z[:, seen]
            gamma = autocovariance(coefficients, float(whitening.sigma[joint]), z.shape[0])
            total[np.ix_(seen, seen)] += z.T @ times(gamma, spectrum(z))
    return total


def autocovariance(coefficients: FloatArray, sigma: float, lags: int) -> FloatArray:
    """Autocovariances γ₀ … γ_{lags−1} of e_t = Σ a_i e_{t−i} + u_t with deviation ``sigma`` of u."""
    impulse = np.zeros(lags)
    impulse[0] = 1.0
    response = recursion(np.concatenate([[1.0], -coefficients]), impulse)
    alive = np.flatnonzero(np.abs(response) > _NEGLIGIBLE)
    response = response[: alive[-1] + 1]
    gamma = np.correlate(response, response, mode="full")[response.size - 1 :]
    padded = np.zeros(lags)
    padded[: gamma.size] = sigma**2 * gamma
    return padded


def instrumental_covariance(
    instruments: FloatArray,
    regressor: FloatArray,
    sigma: FloatArray,
    whitening: Whitening,
    segment: IntArray,
    used: BoolArray | None = None,
) -> FloatArray:
    """Covariance (b, b) of the IV estimate when errors are AR: (ZᵀΩ⁻¹X)⁻¹ S (XᵀΩ⁻¹Z)⁻¹.

    Args:
        instruments: samples × joints × b.
        regressor: samples × joints × b.
        sigma: (n,) the deviations that make Ω.
        whitening: the AR process per joint.
        segment: (samples,) recordings.
        used: samples × joints, false where a row is left out; all are used where None.
    """
    weights = (np.ones(regressor.shape[:2]) if used is None else used) / sigma**2
    cross = np.zeros((instruments.shape[2], regressor.shape[2]))
    for joint in range(regressor.shape[1]):
        cross += weighted_product(instruments[:, joint], regressor[:, joint], weights[:, joint])
    score = weighted_score_covariance(instruments, sigma, whitening, segment, used)
    # Columns of kilogrammes beside columns of friction, and products by fast convolution: rounding is a share
    # of the largest, and took variances of small ones below zero. The root of the score has no such side.
    scale = np.sqrt(np.maximum(np.diag(score), 0.0))
    scale[scale == 0.0] = 1.0
    values, vectors = eigen_of(0.5 * (score + score.T) / np.outer(scale, scale))
    root = scale[:, np.newaxis] * vectors * np.sqrt(np.maximum(values, 0.0))
    half = np.linalg.solve(cross / scale[:, np.newaxis], root / scale[:, np.newaxis])
    return np.asarray(half @ half.T)
