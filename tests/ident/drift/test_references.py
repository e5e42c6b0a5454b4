"""The pieces of the comparison against independent references: statsmodels, scipy, exact Markov chains."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import stats
from statsmodels.stats.diagnostic import recursive_olsresiduals
from statsmodels.stats.multitest import multipletests

import robots
from ident import IdentificationError, RegressorModel, base_parameters
from ident.drift import Relation, common_base, cusum, holm, run_length, trend_threshold, wald_test
from ident.drift.change_point import Warmth, change_shape, find_change
from ident.drift.charts import normal_scores, one_night_threshold
from ident.drift.run_to_run import recursive_residuals, run_to_run_covariance
from robots.arrays import FloatArray


def test_holm_is_that_of_statsmodels() -> None:
    rng = np.random.default_rng(0)
    for size in (1, 2, 60):
        p_values = rng.uniform(size=size) ** 3
        np.testing.assert_allclose(holm(p_values), multipletests(p_values, method="holm")[1], rtol=1e-12)


@pytest.mark.parametrize("apart", [0.3, 1.0, 8.0])
def test_wald_test_is_that_of_statsmodels(apart: float) -> None:
    """Beside values that are not zero, and for probabilities that are not tiny as well as some that are."""
    rng = np.random.default_rng(1)
    x = rng.normal(size=(80, 4)) * [1.0, 1e-3, 50.0, 1.0]
    fit = sm.OLS(x @ [1.0, 2.0, 0.1, -3.0] + rng.normal(size=80), x).fit()
    covariance = fit.cov_params()
    old = fit.params - apart * np.linalg.cholesky(covariance) @ rng.normal(size=4)
    found = wald_test(fit.params, old, covariance, name="t", null="n")
    reference = fit.wald_test((np.eye(4), old), use_f=False, scalar=True)
    assert (0.01 < reference.pvalue < 1.0) == (apart < 2.0)
    assert found.statistic == pytest.approx(float(reference.statistic), rel=1e-9)
    assert np.log(found.p_value) == pytest.approx(np.log(float(reference.pvalue)), rel=1e-9, abs=1e-12)
    assert found.df == (4,)
    as_f = wald_test(fit.params, old, covariance, name="t", null="n", runs=77)
    reference = fit.wald_test((np.eye(4), old), use_f=True, scalar=True)
    assert as_f.statistic == pytest.approx(float(reference.statistic), rel=1e-9)
    assert np.log(as_f.p_value) == pytest.approx(np.log(float(reference.pvalue)), rel=1e-9, abs=1e-12)
    assert as_f.df == (reference.df_num, reference.df_denom) == (4.0, 76.0)


def test_wald_test_refuses_what_cannot_be_compared() -> None:
    with pytest.raises(IdentificationError, match="3 and 2 parameters"):
        wald_test(np.zeros(3), np.zeros(2), np.eye(3), name="t", null="n")
    with pytest.raises(IdentificationError, match="not positive"):
        wald_test(np.zeros(2), np.ones(2), np.array([[1.0, 0.0], [0.0, 0.0]]), name="t", null="n")
    with pytest.raises(IdentificationError, match="not positive definite"):
        wald_test(np.zeros(2), np.ones(2), np.array([[1.0, 2.0], [2.0, 1.0]]), name="t", null="n")


def test_recursive_residuals_are_those_of_statsmodels() -> None:
    rng = np.random.default_rng(2)
    celsius = rng.normal(20.0, 3.0, 40)
    series = rng.normal(size=(40, 2)) + 0.3 * celsius[:, np.newaxis]
    design = np.column_stack([np.ones(40), celsius - celsius.mean()])
    found = recursive_residuals(series, celsius, np.ones(40, dtype=bool))
    for column in range(2):
        fit = sm.OLS(series[:, column], design).fit()
        reference = recursive_olsresiduals(fit, skip=3)[4]
        np.testing.assert_allclose(found.error[4:, column], reference[-36:], rtol=1e-8)
    early = sm.OLS(series[:10, 0], design[:10]).fit()
    assert found.scale[10, 0] == pytest.approx(np.sqrt(early.scale), rel=1e-9)


def test_nights_that_are_not_clean_teach_nothing() -> None:
    rng = np.random.default_rng(3)
    series, clean = rng.normal(size=(30, 1)), np.ones(30, dtype=bool)
    clean[12] = False
    wild = series.copy()
    wild[12] = 1e6
    later = slice(13, None)
    np.testing.assert_allclose(
        recursive_residuals(wild, None, clean).error[later],
        recursive_residuals(series, None, clean).error[later],
        rtol=1e-6,
    )


def test_scores_are_standard_normal_whatever_the_variance_is() -> None:
    rng = np.random.default_rng(4)
    series = rng.normal(5.0, 7.0, size=(12, 4000))
    scores = normal_scores(recursive_residuals(series, None, np.ones(12, dtype=bool)))
    assert np.isnan(scores[:2]).all()
    for night in (4, 11):
        assert stats.kstest(scores[night], "norm").pvalue > 0.01
    assert abs(np.corrcoef(scores[10], scores[11])[0, 1]) < 0.05


def _markov_run_length(threshold: float, allowance: float, states: int = 400) -> float:
    """Mean run length of a one-sided CUSUM by the chain of Brook and Evans (1972)."""
    width = 2 * threshold / (2 * states - 1)
    centres = np.arange(states) * width
    upper = centres[np.newaxis, :] - centres[:, np.newaxis] + allowance + width / 2
    moves = stats.norm.cdf(upper) - stats.norm.cdf(upper - width)
    moves[:, 0] = stats.norm.cdf(upper[:, 0])
    return float(np.linalg.solve(np.eye(states) - moves, np.ones(states))[0])


@pytest.mark.parametrize("threshold", [3.0, 5.0, 8.0])
def test_run_length_of_the_cusum_against_the_exact_chain(threshold: float) -> None:
    assert run_length(threshold) == pytest.approx(_markov_run_length(threshold, 0.5), rel=0.05)


def test_thresholds_keep_the_rate_that_they_promise() -> None:
    rate, charts = 1e-3, 30
    assert 2 * charts / run_length(trend_threshold(rate, charts)) == pytest.approx(rate, rel=1e-6)
    limit = one_night_threshold(rate, charts)
    assert charts * 2 * stats.norm.sf(limit) == pytest.approx(rate, rel=1e-9)


def test_one_wild_night_does_not_fire_the_trend() -> None:
    scores = np.zeros((30, 1))
    scores[10] = 50.0
    up, down = cusum(scores)
    assert up.max() <= 4.0
    assert down.max() == 0.0


def test_nights_that_hang_together_count_less() -> None:
    rng = np.random.default_rng(5)
    noise = rng.normal(size=(300, 200))
    together = np.zeros_like(noise)
    for k in range(1, 300):
        together[k] = 0.6 * together[k - 1] + 0.8 * noise[k]
    limit = trend_threshold(1e-4, 1)
    fired = (cusum(together)[0][60:] > limit).any(axis=0).mean()
    high = peak = np.zeros(200)
    for row in together:
        high = np.maximum(0.0, high + np.clip(row, -4, 4) - 0.5)
        peak = np.maximum(peak, high)
    assert fired < 0.5 * (peak > limit).mean()


@pytest.mark.parametrize(("shape", "start"), [("step", 25), ("ramp", 18)])
def test_change_point_and_shape(shape: str, start: int) -> None:
    rng = np.random.default_rng(6)
    day = np.arange(40.0)
    celsius = rng.normal(20, 3, 40)
    course = (day >= start) * 3.0 if shape == "step" else np.maximum(day - start + 1, 0) * 0.4
    warmth = Warmth(celsius, np.array(0.4), 10.0)
    found = find_change(course + 0.5 * celsius + 0.3 * rng.normal(size=40), day, warmth, 5)
    assert found.shape == shape
    assert abs(found.start - start) <= (0 if shape == "step" else 3)
    assert found.first <= start <= found.last
    assert found.wear < 0.01 if shape == "step" else found.wear > 0.99


def test_onsets_and_wear_are_as_sure_as_they_say() -> None:
    """600 changes of 1 to 5 deviations, half of them wear: 95 % lie between the nights that are told."""
    rng = np.random.default_rng(11)
    held, off, wear, grew = [], [], [], []
    for k in range(600):
        day = np.arange(float(rng.integers(35, 61)))
        grows = bool(k % 2)
        start = int(rng.integers(5, day.size - (8 if grows else 4)))
        course = change_shape(day, start, "ramp" if grows else "step") * rng.uniform(1.0, 5.0)
        found = find_change(course + rng.normal(size=day.size), day, None, 1)
        held.append(found.first <= start <= found.last)
        off.append(abs(found.start - start))
        wear.append(found.wear)
        grew.append(grows)
    assert 0.93 <= np.mean(held) <= 1.0
    assert np.median(off) <= 2
    said, grown = np.array(wear), np.array(grew)
    for low, high in ((0.0, 0.2), (0.2, 0.8), (0.8, 1.0)):
        some = (said >= low) & (said <= high)
        sigma = np.sqrt(0.25 / some.sum())
        assert grown[some].mean() == pytest.approx(said[some].mean(), abs=3.0 * sigma)


def test_run_to_run_covariance_finds_what_moves_together() -> None:
    rng = np.random.default_rng(7)
    within = np.diag([0.01] * 6)
    common = np.array([2.0, -1.0, 1.0, 0.0, 0.0, 0.0])
    values = rng.normal(size=(400, 1)) * common + rng.normal(size=(400, 6)) * [0.1, 0.1, 0.1, 0.1, 0.5, 0.1]
    found = run_to_run_covariance(values, within, None)
    expected = np.outer(common, common) + np.diag([0.0, 0.0, 0.0, 0.0, 0.24, 0.0])
    assert np.abs(found - expected).max() < 0.8  # a variance of 4 from 400 nights
    across = np.array([1.0, 2.0, 0.0, 0.0, 0.0, 0.0]) / np.sqrt(5)
    assert across @ found @ across < 0.05 * (common @ found @ common) / (common @ common)


def test_models_with_different_bases_are_compared_on_what_both_know() -> None:
    robot = robots.load("tx40")
    old = base_parameters(RegressorModel.of(robot))
    settings = robot.identification.model_copy(update={"friction": "asymmetric"})
    other = robot.model_copy(update={"identification": settings})
    new = base_parameters(RegressorModel.of(other))
    common = common_base(Relation.of(old), Relation.of(new))
    assert set(common.names) | set(common.lost) == set(old.names)
    assert common.lost  # symmetric friction is no function of two different sides
    assert {"MX2R", "ZZ2R"} <= set(common.names)
    standard = np.random.default_rng(8).normal(size=len(new.model.names))
    named = dict(zip(new.model.names, standard, strict=True))
    of_old = old.regroup({name: named.get(name, 0.0) for name in old.model.names})
    only_shared = [k for k, name in enumerate(common.names) if not name.startswith(("F", "off"))]
    found = (common.of_new @ new.regroup(standard))[only_shared]
    np.testing.assert_allclose(found, (common.of_old @ of_old)[only_shared], rtol=1e-6, atol=1e-8)


def test_the_same_base_is_its_own_common_base() -> None:
    base = base_parameters(RegressorModel.of(robots.load("emps")))
    common = common_base(Relation.of(base), Relation.of(base))
    identity: FloatArray = np.eye(len(base.names))
    np.testing.assert_allclose(common.of_new, identity, atol=1e-9)
    assert common.names == base.names and common.lost == ()
