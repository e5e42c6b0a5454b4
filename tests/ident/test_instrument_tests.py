"""Exogeneity, over-identification and relevance tests against linearmodels on the same matrices."""

from __future__ import annotations

import numpy as np
import pytest
from linearmodels.iv import IV2SLS, IVGMM, IVLIML
from scipy.stats import chi2

from ident.errors import IdentificationError
from ident.exogeneity import WhiteRows
from ident.exogeneity.overidentification import basmann, basmann_f, hansen_j, sargan
from ident.exogeneity.relevance import (
    anderson,
    conditional_f,
    cragg_donald,
    cragg_donald_f,
    kleibergen_paap,
    partial_f,
)
from ident.exogeneity.wooldridge import wooldridge_regression, wooldridge_score

ROWS = 400


def rows(seed: int = 0, endogeneity: float = 0.4, invalid: float = 0.0, strength: float = 1.0) -> WhiteRows:
    """Two endogenous regressors, two exogenous (one constant), four excluded instruments."""
    generator = np.random.default_rng(seed)
    exogenous = np.column_stack([np.ones(ROWS), generator.normal(size=ROWS)])
    excluded = generator.normal(size=(ROWS, 4))
    v = generator.normal(size=(ROWS, 2))
    mixing = np.array([[1.0, 0.2], [0.3, strength], [0.5, -0.4 * strength], [0.0, 0.1 * strength]])
    endogenous = excluded @ mixing + exogenous[:, [1]] + v
    errors = generator.normal(size=ROWS) * (1 + 0.5 * np.abs(exogenous[:, 1])) + endogeneity * v[:, 0]
    y = endogenous @ [1.0, -1.0] + exogenous @ [0.5, 2.0] + errors + invalid * excluded[:, 3]
    return WhiteRows(y, np.hstack([exogenous, endogenous]), np.hstack([exogenous, excluded]))


def split(case: WhiteRows) -> tuple[object, ...]:
    return case.y, case.x[:, :2], case.x[:, 2:], case.z[:, 2:]


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [(wooldridge_score, "wooldridge_score"), (wooldridge_regression, "wooldridge_regression")],
)
@pytest.mark.parametrize("endogeneity", [0.0, 0.4])
def test_robust_endogeneity_tests_are_those_of_linearmodels(ours, theirs: str, endogeneity: float) -> None:
    case = rows(1, endogeneity)
    found, reference = ours(case), getattr(IV2SLS(*split(case)).fit(), theirs)
    assert found.statistic == pytest.approx(reference.stat, rel=1e-8)
    assert found.p_value == pytest.approx(reference.pval, rel=1e-7)
    assert found.df == (reference.df,)
    assert found.rejects() is (endogeneity > 0)


@pytest.mark.parametrize("invalid", [0.0, 0.5])
def test_overidentification_tests_are_those_of_linearmodels(invalid: float) -> None:
    case = rows(2, invalid=invalid)
    two_stage, liml = IV2SLS(*split(case)).fit(), IVLIML(*split(case)).fit()
    for found, reference in (
        (sargan(case), two_stage.sargan),
        (basmann(case), two_stage.basmann),
        (basmann_f(case), liml.basmann_f),
        (hansen_j(case), IVGMM(*split(case)).fit(cov_type="robust").j_stat),
    ):
        assert found.statistic == pytest.approx(reference.stat, rel=1e-8)
        assert found.p_value == pytest.approx(reference.pval, rel=1e-6)
        assert found.rejects() is (invalid > 0)


def test_first_stage_f_is_that_of_linearmodels() -> None:
    case = rows(3)
    reference = IV2SLS(*split(case)).fit(cov_type="unadjusted", debiased=True).first_stage.diagnostics
    found = partial_f(case)
    assert list(found) == [2, 3]
    for test, statistic in zip(found.values(), reference["f.stat"], strict=True):
        assert test.statistic == pytest.approx(float(statistic), rel=1e-8)


def test_conditional_f_of_one_regressor_is_the_first_stage_f() -> None:
    case = rows(4)
    alone = WhiteRows(case.y, case.x[:, :3], case.z)
    first, conditional = partial_f(alone)[2], conditional_f(alone)[2]
    assert conditional.statistic == pytest.approx(first.statistic, rel=1e-10)
    assert cragg_donald_f(alone) == pytest.approx(first.statistic, rel=1e-10)


def test_conditional_f_sees_that_two_regressors_share_one_instrument() -> None:
    generator = np.random.default_rng(5)
    z = generator.normal(size=(ROWS, 4))
    x = z[:, [0]] @ [[1.0, 0.8]] + generator.normal(size=(ROWS, 2))
    case = WhiteRows(x.sum(axis=1) + generator.normal(size=ROWS), x, z)
    assert min(test.statistic for test in partial_f(case).values()) > 40
    assert max(test.statistic for test in conditional_f(case).values()) < 5
    assert not cragg_donald(case).rejects(0.01)


def test_rank_statistics_by_their_written_out_definitions() -> None:
    case = rows(6)
    exogenous, x, z = case.x[:, :2], case.x[:, 2:], case.z[:, 2:]
    residual_maker = np.eye(ROWS) - exogenous @ np.linalg.pinv(exogenous)
    x, z = residual_maker @ x, residual_maker @ z
    projector = z @ np.linalg.pinv(z)
    within = np.linalg.inv(x.T @ x) @ x.T @ projector @ x
    rho = float(np.min(np.linalg.eigvals(within).real))
    assert anderson(case).statistic == pytest.approx(ROWS * rho, rel=1e-8)
    assert anderson(case).df == (3.0,)
    assert cragg_donald(case).statistic == pytest.approx((ROWS - 6) * rho / (1 - rho), rel=1e-8)


def test_kleibergen_paap_of_one_regressor_is_the_robust_first_stage_wald() -> None:
    case = rows(7)
    alone = WhiteRows(case.y, case.x[:, :3], case.z)
    fit = IV2SLS(case.y, case.x[:, :2], case.x[:, 2:3], case.z[:, 2:]).fit(cov_type="robust")
    expected = float(fit.first_stage.diagnostics["f.stat"].iloc[0])
    assert kleibergen_paap(alone).statistic == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("test", [anderson, cragg_donald, kleibergen_paap])
def test_rank_statistics_hold_their_size_where_rank_is_lacking(test) -> None:
    # 300 replicates at 5 %: within 2 to 9 % with probability 0.997.
    statistics = []
    for seed in range(300):
        generator = np.random.default_rng(seed)
        z = generator.normal(size=(ROWS, 4))
        x = z[:, [0]] @ [[1.0, 0.8]] + generator.normal(size=(ROWS, 2))
        statistics.append(test(WhiteRows(x[:, 0], x, z)).statistic)
    assert 0.02 <= np.mean(np.array(statistics) > chi2.isf(0.05, 3)) <= 0.09
    assert test(rows(8)).rejects(1e-6)


def test_as_many_instruments_as_parameters_leave_nothing_to_test() -> None:
    case = rows(9)
    with pytest.raises(IdentificationError, match="4 instruments for 4 parameters"):
        sargan(WhiteRows(case.y, case.x, case.z[:, :4]))


def test_small_samples_take_f() -> None:
    found, large = wooldridge_regression(rows(10), small_sample=True), wooldridge_regression(rows(10))
    assert found.distribution == "F"
    assert found.p_value > large.p_value
