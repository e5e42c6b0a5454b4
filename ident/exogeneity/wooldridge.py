"""Durbin-Wu-Hausman tests that stand any variance in any row (Wooldridge 1995; 2010, section 6.3.1)."""

from __future__ import annotations

import numpy as np

from ident.exogeneity.hypothesis import HypothesisTest, annihilate, chi2_test, f_test, wald_statistic
from ident.exogeneity.textbook import WhiteRows, informative
from robots.arrays import FloatArray

_NULL = "γ = 0: the regressors are uncorrelated with the errors"


def first_stage_residuals(rows: WhiteRows) -> FloatArray:
    """V̂ without the columns that are null to machine precision: (r, k)."""
    _, v = rows.first_stage()
    return np.asarray(v[:, informative(rows.x, v)])


def wooldridge_score(rows: WhiteRows) -> HypothesisTest:
    """Score test: ones on ε̂·v̂, where v̂ has the regressors partialled out; r − SSR is χ².

    Args:
        rows: weighted by Ω.
    """
    residual = annihilate(rows.y[:, np.newaxis], rows.x)
    v = first_stage_residuals(rows)
    scores = annihilate(v, rows.x) * residual
    left = annihilate(np.ones((rows.y.size, 1)), scores)
    statistic = rows.y.size - float(np.sum(left**2))
    return chi2_test("Wooldridge's score test", _NULL, statistic, v.shape[1])


def wooldridge_regression(rows: WhiteRows, small_sample: bool = False) -> HypothesisTest:
    """Wald test of γ = 0 in y = Xβ + V̂γ + e with White's covariance.

    Args:
        rows: weighted by Ω.
        small_sample: HC1 and an F distribution instead of HC0 and χ².
    """
    v = first_stage_residuals(rows)
    augmented = np.hstack([rows.x, v])
    b, k = rows.x.shape[1], v.shape[1]
    q, r = np.linalg.qr(augmented)
    gamma = np.linalg.solve(r, q.T @ rows.y)
    residual = rows.y - augmented @ gamma
    scores = np.linalg.solve(r, (q * residual[:, np.newaxis]).T)[b:]
    statistic = wald_statistic(gamma[b:], scores @ scores.T)
    name = "Wooldridge's regression test"
    if not small_sample:
        return chi2_test(name, _NULL, statistic, k)
    freedom = rows.y.size - augmented.shape[1]
    return f_test(name, _NULL, statistic * freedom / rows.y.size / k, k, freedom)
