"""Essential parameters: the needless go, the needed stay, and each step is an F-test."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm

from ident.errors import IdentificationError
from ident.estimators import Stacked, essential_parameters

NAMES = tuple(f"p{k}" for k in range(8))
TRUTH = np.array([3.0, 0.0, -1.5, 0.0, 0.8, 0.0, 0.25, 0.0])
NEEDED = {name for name, value in zip(NAMES, TRUTH, strict=True) if value}


def problem(seed: int, samples: int = 250) -> Stacked:
    generator = np.random.default_rng(seed)
    x = generator.normal(size=(2 * samples, 8))
    x[:, 1] += 0.8 * x[:, 0]
    noise = np.repeat([0.5, 2.0], samples) * generator.normal(size=2 * samples)
    return Stacked(x @ TRUTH + noise, x, np.repeat([0, 1], samples))


def test_needed_parameters_stay_and_needless_ones_go_over_200_seeds() -> None:
    lost, all_gone, needless_gone = 0, 0, 0
    for seed in range(200):
        fit = essential_parameters(problem(seed), NAMES)
        gone = {step.name for step in fit.dropped}
        lost += bool(gone & NEEDED)
        needless_gone += len(gone - NEEDED)
        all_gone += gone >= set(NAMES) - NEEDED
    # The weakest is seen with 13 % σ: it may fall below the F-test's sight, seldom.
    assert lost / 200 <= 0.02
    assert needless_gone / (4 * 200) >= 0.93
    assert all_gone / 200 >= 0.85


def test_each_step_is_the_f_test_of_statsmodels() -> None:
    stacked = problem(3)
    fit = essential_parameters(stacked, NAMES)
    sigma = [
        np.sqrt(sm.OLS(stacked.y[p], stacked.x[p]).fit().mse_resid) for p in (slice(250), slice(250, 500))
    ]
    weights = np.repeat(np.array(sigma) ** -2.0, 250)
    full = sm.WLS(stacked.y, stacked.x, weights=weights).fit()
    kept = list(range(8))
    assert len(fit.dropped) >= 3
    for step in fit.dropped:
        kept.remove(NAMES.index(step.name))
        fewer = sm.WLS(stacked.y, stacked.x[:, kept], weights=weights).fit()
        statistic, p, df = full.compare_f_test(fewer)
        assert step.statistic == pytest.approx(statistic, rel=1e-8)
        assert step.p_value == pytest.approx(p, rel=1e-8)
        assert step.df == (df, full.df_resid)
    assert fit.beta == pytest.approx(fewer.params, rel=1e-10)
    assert fit.covariance == pytest.approx(fewer.cov_params(), rel=1e-8)


def test_what_the_f_test_refuses_to_drop_is_told() -> None:
    stacked = problem(0)
    fit = essential_parameters(stacked, NAMES, percent_sigma=0.0)
    assert fit.refused is not None
    assert fit.refused.name == "p6"
    assert fit.refused.p_value < 0.05
    assert set(fit.names) == NEEDED


def test_parameters_that_are_seen_well_are_never_tried() -> None:
    fit = essential_parameters(problem(0), NAMES, percent_sigma=1e9)
    assert fit.names == NAMES
    assert fit.dropped == ()


def test_rows_that_determine_nothing_are_refused() -> None:
    stacked = problem(0)
    x = stacked.x.copy()
    x[:, 4] = x[:, 5]
    with pytest.raises(IdentificationError, match="tell apart p4, p5"):
        essential_parameters(Stacked(stacked.y, x, stacked.joint), NAMES)
