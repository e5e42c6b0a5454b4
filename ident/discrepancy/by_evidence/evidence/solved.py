"""Evidence and posterior of sets from reduced Gram matrices: one Cholesky factor each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.special import log_ndtr

from ident.discrepancy.by_evidence.evidence.rows import WhiteEffects
from robots.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of one set at a given level of the misfit.

    Attributes:
        log_evidence: nats, up to a constant that all sets on the same rows share.
        known: (k,) mean of the known factors.
        theta: (p,) mean of the effects' parameters, in units of their scales.
        factor: (k + p, k + p) lower Cholesky factor of both's precision.
    """

    log_evidence: float
    known: FloatArray
    theta: FloatArray
    factor: FloatArray

    @cached_property
    def covariance(self) -> FloatArray:
        """(k + p, k + p) of known factors and θ; most sets are fitted and never asked for it."""
        return np.asarray(cho_solve((self.factor, True), np.eye(self.factor.shape[0]), check_finite=False))


def solve(
    whole: FloatArray, volume: float, precision: FloatArray, parts: Sequence[WhiteEffects]
) -> Posterior:
    """Evidence and posterior of a set whose reduced Gram matrix is over [known, y, its columns]."""
    k, p = precision.size, sum(part.count for part in parts)
    centre = np.concatenate([part.centre for part in parts]) if parts else np.zeros(0)
    inner = np.concatenate([np.arange(k), np.arange(k + 1, k + 1 + p)])
    system = whole[np.ix_(inner, inner)].copy()
    shift = whole[inner, k + 1 :] @ centre
    right = whole[inner, k] - shift
    power = whole[k, k] - 2.0 * whole[k, k + 1 :] @ centre + centre @ whole[k + 1 :, k + 1 :] @ centre
    system[np.arange(k + p), np.arange(k + p)] += np.concatenate([precision, np.ones(p)])
    factor = cholesky(system, lower=True, check_finite=False)
    mean = cho_solve((factor, True), right, check_finite=False)
    log_evidence = 0.5 * (float(right @ mean) - float(power)) - float(np.log(np.diag(factor)).sum())
    theta = mean[k:] + centre
    # θ stands last, so its own block of the factor is that of its precision with all else integrated.
    own = cho_solve((factor[k:, k:], True), np.eye(p), check_finite=False)
    for_bounds = float(bounds_factor(theta, np.sqrt(np.diag(own)), parts))
    unsaid = sum(part.unsaid for part in parts)
    return Posterior(log_evidence + volume + for_bounds - unsaid, mean[:k], theta, factor)


def log_evidences(whole: FloatArray, precision: FloatArray, parts: Sequence[WhiteEffects]) -> FloatArray:
    """(K,) log evidence of a set, less the log volume, of K reduced Gram matrices (K, …, …) at once.

    With the right side as a last row its factor is L⁻¹ z, and θ, which stands before it, is a small solve.
    """
    k, p = precision.size, sum(part.count for part in parts)
    centre = np.concatenate([part.centre for part in parts]) if parts else np.zeros(0)
    beside = whole[:, :, k + 1 :] @ centre
    power = whole[:, k, k] - 2.0 * beside[:, k] + beside[:, k + 1 :] @ centre
    system = np.empty((whole.shape[0], k + p + 1, k + p + 1))
    pieces = ((slice(k), slice(k)), (slice(k + 1, None), slice(k, -1)))  # y stands between, and goes last
    for here, there in pieces:
        for of, to in pieces:
            system[:, there, to] = whole[:, here, of]
        system[:, -1, there] = system[:, there, -1] = whole[:, here, k] - beside[:, here]
    system[:, np.arange(k + p), np.arange(k + p)] += np.concatenate([precision, np.ones(p)])
    system[:, -1, -1] = 2.0 * np.abs(whole[:, k, k]) + np.abs(power) + 1.0
    factor = np.linalg.cholesky(system)
    last = factor[:, -1, :-1]
    logs = np.log(np.diagonal(factor, axis1=1, axis2=2)[:, :-1]).sum(axis=1)
    evidence = 0.5 * (np.sum(last**2, axis=1) - power) - logs - sum(part.unsaid for part in parts)
    if not any(np.isfinite(part.bounds).any() for part in parts):
        return np.asarray(evidence)
    # θ stands last, so its own block of the factor is that of its precision with all else integrated.
    inverse = np.linalg.inv(factor[:, k:-1, k:-1])
    theta = np.einsum("Kqp,Kq->Kp", inverse, last[:, k:]) + centre
    return np.asarray(evidence + bounds_factor(theta, np.sqrt(np.sum(inverse**2, axis=1)), parts))


def bounds_factor(mean: FloatArray, deviation: FloatArray, parts: Sequence[WhiteEffects]) -> FloatArray:
    """Log of the posterior's mass within the bounds over the prior's, over parameters, (…, p) → (…,)."""
    if not parts:
        return np.zeros(mean.shape[:-1])
    bounds = np.concatenate([part.bounds for part in parts])
    centre = np.concatenate([part.centre for part in parts])
    return mass_within(mean, deviation, centre, bounds)


def mass_within(
    mean: FloatArray, deviation: FloatArray, centre: FloatArray, bounds: FloatArray
) -> FloatArray:
    """The same of parameters (…, p) about their prior's centre (…, p) within bounds (…, p, 2)."""
    if not np.isfinite(bounds).any():
        return np.zeros(mean.shape[:-1])
    low, high = bounds[..., 0], bounds[..., 1]
    after = _log_mass((low - mean) / deviation, (high - mean) / deviation)
    return np.asarray(np.sum(after - _log_mass(low - centre, high - centre), axis=-1))


def _log_mass(low: FloatArray, high: FloatArray) -> FloatArray:
    """Log of a standard normal's mass between bounds, on the side where it can be told."""
    swapped = low > 0.0
    low, high = np.where(swapped, -high, low), np.where(swapped, -low, high)
    upper, lower = log_ndtr(high), log_ndtr(low)
    return np.asarray(upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-15))))
