"""Two models beside each other: Wald's test and Holm's correction."""

from __future__ import annotations

import numpy as np
from scipy import stats
from scipy.linalg import cho_factor, cho_solve

from ident.drift.values import DriftTest
from ident.errors import IdentificationError
from robots.arrays import FloatArray


def wald_test(
    new: FloatArray, old: FloatArray, covariance: FloatArray, *, name: str, null: str, runs: int | None = None
) -> DriftTest:
    """H0: the two vectors estimate the same parameters. dᵀ S⁻¹ d with S the covariance of d.

    Args:
        new, old: (b,) estimates.
        covariance: (b, b) of their difference.
        name: of the test.
        null: in words.
        runs: number of nights that a run-to-run variance in S was estimated from: then the F distribution
            with ``runs − 1`` degrees of freedom is used, which is wider than χ².

    Raises:
        IdentificationError: the shapes differ, or the covariance is not positive definite.
    """
    if new.shape != old.shape or covariance.shape != (*new.shape, *new.shape):
        raise IdentificationError(
            f"{name}: {new.shape[0]} and {old.shape[0]} parameters with a covariance of shape"
            f" {covariance.shape}; allowed: the same base parameters"
        )
    difference = new - old
    statistic = float(difference @ solve_covariance(covariance, difference))
    size = new.size
    if runs is None:
        return DriftTest(name, null, statistic, f"χ²({size})", (size,), float(stats.chi2.sf(statistic, size)))
    df = (float(size), float(runs - 1))
    p_value = float(stats.f.sf(statistic / size, *df))
    return DriftTest(name, null, statistic / size, f"F({size}, {runs - 1})", df, p_value)


def solve_covariance(covariance: FloatArray, right: FloatArray) -> FloatArray:
    """S⁻¹ b by Cholesky with unit diagonal, so that units do not matter.

    Raises:
        IdentificationError: S is not positive definite.
    """
    diagonal = np.diag(covariance)
    if not (np.isfinite(covariance).all() and (diagonal > 0.0).all()):
        raise IdentificationError("covariance of the parameters has variances that are not positive")
    scale = np.sqrt(diagonal)
    try:
        factor = cho_factor(covariance / np.outer(scale, scale), lower=True)
    except np.linalg.LinAlgError:
        raise IdentificationError("covariance of the parameters is not positive definite") from None
    scaled = (right.T / scale).T
    return np.asarray((cho_solve(factor, scaled).T / scale).T)


def holm(p_values: FloatArray) -> FloatArray:
    """p-values after Holm's step-down correction: at most a share α of all tables has a false one below α."""
    order = np.argsort(p_values, kind="stable")
    factors = np.arange(p_values.size, 0, -1)
    corrected = np.maximum.accumulate(p_values[order] * factors)
    found = np.empty_like(p_values, dtype=np.float64)
    found[order] = np.minimum(corrected, 1.0)
    return found
