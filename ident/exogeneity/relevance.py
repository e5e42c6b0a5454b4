"""Do the instruments move the regressors? Partial F, conditional F and rank statistics on weighted rows.

Regressors that Z holds exactly, as a constant, are exogenous: they are partialled out first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from ident.exogeneity.hypothesis import HypothesisTest, annihilate, chi2_test, f_test, wald_statistic
from ident.exogeneity.textbook import WhiteRows, informative
from robots.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class _FirstStage:
    """What exogenous regressors leave of the others (r, k) and of the instruments (r, m − exogenous)."""

    endogenous: IntArray
    x: FloatArray
    z: FloatArray
    freedom: int

    @property
    def excluded(self) -> int:
        return int(self.z.shape[1])


def partial_f(rows: WhiteRows) -> dict[int, HypothesisTest]:
    """First-stage F of the excluded instruments per regressor that is not exogenous, by its column index."""
    stage = _first_stage(rows)
    tests = {}
    for place, column in enumerate(stage.endogenous):
        target = stage.x[:, place]
        left = _sum_of_squares(annihilate(target[:, np.newaxis], stage.z))
        statistic = (target @ target - left) / stage.excluded / (left / stage.freedom)
        null = f"no instrument moves regressor {column}"
        tests[int(column)] = f_test("first-stage F", null, float(statistic), stage.excluded, stage.freedom)
    return tests


def conditional_f(rows: WhiteRows) -> dict[int, HypothesisTest]:
    """Sanderson-Windmeijer F per regressor: is it moved once the others are accounted for? (2016)

    Where only one regressor is not exogenous it is the first-stage F.
    """
    stage = _first_stage(rows)
    count = stage.endogenous.size
    if count == 0:
        return {}
    v = annihilate(stage.x, stage.z)
    explained = stage.x - v
    scale = np.linalg.norm(stage.x, axis=0)
    inverse = np.linalg.inv((explained / scale).T @ (explained / scale))
    left = (v / scale).T @ (v / scale)
    df = stage.excluded - count + 1
    tests = {}
    for place, column in enumerate(stage.endogenous):
        # x_k less what two-stage least squares on the other regressors makes of it, in units of the columns.
        combination = inverse[:, place] / inverse[place, place]
        noise = float(combination @ left @ combination) / stage.freedom
        statistic = 1.0 / float(inverse[place, place]) / df / noise
        null = f"regressor {column} is not identified beside the others"
        tests[int(column)] = f_test("Sanderson-Windmeijer conditional F", null, statistic, df, stage.freedom)
    return tests


def cragg_donald(rows: WhiteRows) -> HypothesisTest:
    """Cragg and Donald's (1993) rank statistic, the smallest eigenvalue of the matrix of first-stage F.

    As a Wald statistic it is χ²(m − b + 1) where Π lacks one rank; divided by the instruments it is what
    Stock and Yogo tabulate, see :func:`cragg_donald_f`.
    """
    stage = _first_stage(rows)
    statistic = _smallest_root(stage) * stage.freedom
    df = stage.excluded - stage.endogenous.size + 1
    return chi2_test("Cragg-Donald", "the instruments leave one direction unidentified", statistic, df)


def cragg_donald_f(rows: WhiteRows) -> float:
    """Cragg-Donald F, for comparison with the critical values of Stock and Yogo (2005)."""
    stage = _first_stage(rows)
    return _smallest_root(stage) * stage.freedom / stage.excluded


def anderson(rows: WhiteRows) -> HypothesisTest:
    """Anderson's (1951) test of the smallest canonical correlation ρ of X and Z: r·ρ² is χ²."""
    stage = _first_stage(rows)
    root = _smallest_root(stage)
    df = stage.excluded - stage.endogenous.size + 1
    statistic = rows.y.size * root / (1.0 + root)
    null = "the smallest canonical correlation of regressors and instruments is zero"
    return chi2_test("Anderson's canonical correlations", null, statistic, df)


def kleibergen_paap(rows: WhiteRows) -> HypothesisTest:
    """Kleibergen and Paap's (2006) rank Wald statistic: as Cragg-Donald, any variance in any row.

    Π̂ is scaled to orthonormal instruments and first-stage residuals; its smallest singular direction is what
    is tested, with White's covariance of Π̂.
    """
    stage = _first_stage(rows)
    k = stage.endogenous.size
    q, _ = np.linalg.qr(stage.z)
    pi = q.T @ stage.x
    v = stage.x - q @ pi
    white = np.linalg.inv(np.linalg.cholesky(v.T @ v / rows.y.size)).T
    theta, v = pi @ white, v @ white
    u, _, vt = np.linalg.svd(theta)
    left, right = u[:, k - 1 :], vt.T[:, k - 1 :]
    smallest = (left.T @ theta @ right).ravel()
    # vec of AᵀΘ̂B: each row's contribution is (AᵀZ_i)(v_iB).
    contributions = (q @ left) * (v @ right)
    statistic = wald_statistic(smallest, contributions.T @ contributions)
    df = stage.excluded - k + 1
    return chi2_test("Kleibergen-Paap", "the instruments leave one direction unidentified", statistic, df)


def _first_stage(rows: WhiteRows) -> _FirstStage:
    endogenous = informative(rows.x, rows.first_stage()[1])
    exogenous = np.delete(rows.x, endogenous, axis=1)
    freedom = rows.y.size - rows.z.shape[1]
    if exogenous.shape[1] == 0:
        return _FirstStage(endogenous, rows.x, rows.z, freedom)
    left = annihilate(rows.z, exogenous)
    u, values, _ = np.linalg.svd(left, full_matrices=False)
    held = rows.z.shape[1] - exogenous.shape[1]
    basis = u[:, :held] * values[:held]
    return _FirstStage(endogenous, annihilate(rows.x[:, endogenous], exogenous), basis, freedom)


def _smallest_root(stage: _FirstStage) -> float:
    """Smallest root of |X̂ᵀX̂ − λV̂ᵀV̂| = 0, λ = ρ²/(1 − ρ²)."""
    v = annihilate(stage.x, stage.z)
    explained = stage.x - v
    return float(eigh(explained.T @ explained, v.T @ v, eigvals_only=True)[0])


def _sum_of_squares(values: FloatArray) -> float:
    return float(np.sum(values**2))
