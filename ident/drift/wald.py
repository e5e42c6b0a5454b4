"""Two models beside each other: Wald's test, Holm's correction, and a common set where bases differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.linalg import cho_factor, cho_solve

from ident.base import BaseParameters
from ident.drift.values import DriftTest
from ident.errors import IdentificationError
from robots.arrays import FloatArray

_REPRESENTED = 1e-6
"""A base parameter is known from another base where at most this share of its relation is left over."""


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


@dataclass(frozen=True)
class CommonBase:
    """What two bases both know: ``names`` (c,), and matrices (c, b) that take each base vector to it."""

    names: tuple[str, ...]
    of_old: FloatArray
    of_new: FloatArray
    lost: tuple[str, ...]
    """Parameters of the old base that the new one cannot tell."""


def common_base(old: BaseParameters, new: BaseParameters) -> CommonBase:
    """The parameters of the old base that are functions of the new one.

    Both relations are written over the union of the standard parameters. A row of the old relation that lies
    in the row space of the new one is known from both models.
    """
    standard = tuple(dict.fromkeys((*old.model.names, *new.model.names)))
    a, b = _over(old, standard), _over(new, standard)
    mapping = np.linalg.lstsq(b.T, a.T, rcond=None)[0].T
    left = np.linalg.norm(a - mapping @ b, axis=1) / np.linalg.norm(a, axis=1)
    kept = np.flatnonzero(left < _REPRESENTED)
    mapping[np.abs(mapping) < _REPRESENTED * np.abs(mapping).max()] = 0.0
    return CommonBase(
        tuple(old.names[k] for k in kept),
        np.eye(len(old.names))[kept],
        np.asarray(mapping[kept]),
        tuple(name for k, name in enumerate(old.names) if k not in kept),
    )


def _over(base: BaseParameters, standard: tuple[str, ...]) -> FloatArray:
    place = {name: column for column, name in enumerate(standard)}
    matrix = np.zeros((base.relation.shape[0], len(standard)))
    matrix[:, [place[name] for name in base.model.names]] = base.relation
    return matrix
