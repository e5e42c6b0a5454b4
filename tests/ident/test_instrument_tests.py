"""Relevance of instruments against linearmodels on the same matrices."""

from __future__ import annotations

import numpy as np
import pytest
from linearmodels.iv import IV2SLS

from ident.exogeneity import WhiteRows
from ident.exogeneity.relevance import conditional_f, partial_f

ROWS = 400


def rows(seed: int) -> WhiteRows:
    """Two endogenous regressors, two exogenous (one constant), four excluded instruments."""
    generator = np.random.default_rng(seed)
    exogenous = np.column_stack([np.ones(ROWS), generator.normal(size=ROWS)])
    excluded = generator.normal(size=(ROWS, 4))
    v = generator.normal(size=(ROWS, 2))
    mixing = np.array([[1.0, 0.2], [0.3, 1.0], [0.5, -0.4], [0.0, 0.1]])
    endogenous = excluded @ mixing + exogenous[:, [1]] + v
    errors = generator.normal(size=ROWS) * (1 + 0.5 * np.abs(exogenous[:, 1])) + 0.4 * v[:, 0]
    y = endogenous @ [1.0, -1.0] + exogenous @ [0.5, 2.0] + errors
    return WhiteRows(y, np.hstack([exogenous, endogenous]), np.hstack([exogenous, excluded]))


def split(case: WhiteRows) -> tuple[object, ...]:
    return case.y, case.x[:, :2], case.x[:, 2:], case.z[:, 2:]


def test_first_stage_f_is_that_of_linearmodels() -> None:
    case = rows(3)
    reference = IV2SLS(*split(case)).fit(cov_type="unadjusted", debiased=True).first_stage.diagnostics
    found = partial_f(case)
    assert list(found) == [2, 3]
    for test, statistic in zip(found.values(), reference["f.stat"], strict=True):
        assert test.statistic == pytest.approx(float(statistic), rel=1e-8)


@pytest.mark.parametrize("exogenous", [0, 1])
def test_first_stage_f_with_one_exogenous_regressor_and_with_none(exogenous: int) -> None:
    case = rows(6)
    kept = WhiteRows(case.y, case.x[:, 2 - exogenous :], case.z[:, 2 - exogenous :])
    parts = kept.y, kept.x[:, :exogenous] if exogenous else None, kept.x[:, exogenous:], kept.z[:, exogenous:]
    reference = IV2SLS(*parts).fit(cov_type="unadjusted", debiased=True).first_stage.diagnostics
    found = [test.statistic for test in partial_f(kept).values()]
    assert found == pytest.approx(list(reference["f.stat"]), rel=1e-8)


def test_conditional_f_of_one_regressor_is_the_first_stage_f() -> None:
    case = rows(4)
    alone = WhiteRows(case.y, case.x[:, :3], case.z)
    first, conditional = partial_f(alone)[2], conditional_f(alone)[2]
    assert conditional.statistic == pytest.approx(first.statistic, rel=1e-10)


def test_conditional_f_sees_that_two_regressors_share_one_instrument() -> None:
    generator = np.random.default_rng(5)
    z = generator.normal(size=(ROWS, 4))
    x = z[:, [0]] @ [[1.0, 0.8]] + generator.normal(size=(ROWS, 2))
    case = WhiteRows(x.sum(axis=1) + generator.normal(size=ROWS), x, z)
    assert min(test.statistic for test in partial_f(case).values()) > 40
    assert max(test.statistic for test in conditional_f(case).values()) < 5
