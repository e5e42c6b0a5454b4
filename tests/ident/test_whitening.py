"""Prewhitening and covariances against simulation and against statsmodels."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from statsmodels.stats.diagnostic import acorr_ljungbox
from statsmodels.tsa.arima_process import arma_acovf

from ident.statistics.covariance import autocovariance, instrumental_covariance
from ident.statistics.whitening import (
    Whitening,
    autoregressive_whitening,
    block_whitening,
    lag1_autocorrelation,
    ljung_box,
)
from robots.arrays import FloatArray


def autoregressive(coefficients: list[float], samples: int, joints: int, seed: int) -> FloatArray:
    generator = np.random.default_rng(seed)
    series = np.zeros((samples + 200, joints))
    shocks = generator.normal(size=series.shape)
    for t in range(len(coefficients), samples + 200):
        series[t] = shocks[t] + sum(a * series[t - k] for k, a in enumerate(coefficients, start=1))
    return series[200:]


def test_the_order_and_the_coefficients_are_found() -> None:
    residual = autoregressive([1.2, -0.5], 6000, 2, seed=1)
    whitening = autoregressive_whitening(
        residual, np.zeros(6000, dtype=np.int64), np.ones((6000, 2), dtype=np.bool_), parameters=10
    )
    for coefficients in whitening.coefficients:
        assert len(coefficients) == pytest.approx(2, abs=1)
        assert coefficients[:2] == pytest.approx([1.2, -0.5], abs=0.05)
    assert whitening.sigma == pytest.approx([1.0, 1.0], rel=0.03)


def test_a_joint_without_rows_takes_no_order_from_the_others() -> None:
    """Met in a simulated loop whose first joint stood still all the time: it ended a diagnosis."""
    residual, segment = autoregressive([1.2, -0.5], 6000, 2, seed=1), np.zeros(6000, dtype=np.int64)
    used = np.ones(residual.shape, dtype=np.bool_)
    alone = autoregressive_whitening(residual[:, 1:], segment, used[:, 1:], parameters=0)
    used[:, 0] = False
    whitening = autoregressive_whitening(residual, segment, used, parameters=0)
    np.testing.assert_array_equal(whitening.coefficients[1], alone.coefficients[0])
    assert whitening.sigma[1] == alone.sigma[0] and whitening.coefficients[0].size == 0
    white = whitening.apply(residual[:, :, np.newaxis], segment, used)
    assert white.shape == (6000 - alone.coefficients[0].size, 1) and np.isfinite(white).all()
    none = autoregressive_whitening(residual, segment, np.zeros_like(used), parameters=0)
    assert none.apply(residual[:, :, np.newaxis], segment, np.zeros_like(used)).shape == (0, 1)


def test_whitened_rows_are_white() -> None:
    residual = autoregressive([0.9], 4000, 3, seed=2)
    segment = np.repeat([0, 1], 2000)
    used = np.ones(residual.shape, dtype=np.bool_)
    whitening = autoregressive_whitening(residual, segment, used, parameters=0)
    white = whitening.apply(residual[:, :, np.newaxis], segment, used).reshape(3, -1)
    assert max(abs(lag1_autocorrelation(series)) for series in white) < 0.05
    assert white.std() == pytest.approx(1.0, rel=0.03)
    assert ljung_box(residual[:, 0])[1] < 1e-6
    assert ljung_box(white[0])[1] > 1e-3


def test_the_filter_never_reaches_across_recordings() -> None:
    whitening = Whitening("ar", (np.array([0.5]),), np.array([1.0]))
    values = np.array([1.0, 1.0, 1.0, 100.0, 100.0, 100.0])[:, np.newaxis, np.newaxis]
    filtered = whitening.apply(values, np.array([0, 0, 0, 1, 1, 1]), np.ones((6, 1), dtype=np.bool_))[:, 0]
    assert filtered.tolist() == [0.5, 0.5, 50.0, 50.0]


def test_a_filtered_row_needs_every_row_that_it_mixes() -> None:
    whitening = Whitening("ar", (np.array([0.5, 0.25]),), np.array([1.0]))
    values = np.arange(8.0)[:, np.newaxis, np.newaxis]
    used = np.array([True, True, True, False, True, True, True, True])[:, np.newaxis]
    filtered = whitening.apply(values, np.zeros(8, dtype=np.int64), used)[:, 0]
    assert filtered.tolist() == [2 - 0.5 * 1, 6 - 0.5 * 5 - 0.25 * 4, 7 - 0.5 * 6 - 0.25 * 5]


def test_left_out_rows_do_not_disturb_the_fit() -> None:
    residual = autoregressive([0.9], 4000, 1, seed=8)
    used = np.ones(residual.shape, dtype=np.bool_)
    used[500:600] = used[2000:2300] = False
    spoiled = np.where(used, residual, 1e3)
    whitening = autoregressive_whitening(spoiled, np.zeros(4000, dtype=np.int64), used, parameters=0)
    assert whitening.coefficients[0] == pytest.approx([0.9], abs=0.03)
    assert whitening.sigma[0] == pytest.approx(1.0, rel=0.05)


def test_block_whitening_is_the_papers_omega() -> None:
    residual = np.random.default_rng(3).normal(size=(500, 2)) * [1.0, 10.0]
    whitening = block_whitening(residual, np.ones(residual.shape, dtype=np.bool_), parameters=4)
    assert whitening.order == 0
    assert whitening.sigma == pytest.approx(np.sqrt(np.sum(residual**2, axis=0) / 498))


def test_ljung_box_agrees_with_statsmodels() -> None:
    series = autoregressive([0.3], 800, 1, seed=4)[:, 0]
    expected = acorr_ljungbox(series, lags=[10])
    statistic, p = ljung_box(series, 10)
    assert statistic == pytest.approx(float(expected["lb_stat"].iloc[0]), rel=1e-10)
    assert p == pytest.approx(float(expected["lb_pvalue"].iloc[0]), rel=1e-8)


def test_autocovariance_agrees_with_statsmodels() -> None:
    coefficients = np.array([1.2, -0.5])
    expected = arma_acovf(np.r_[1.0, -coefficients], [1.0], nobs=60, sigma2=4.0)
    assert autocovariance(coefficients, 2.0, 400)[:60] == pytest.approx(expected, abs=1e-5)


def test_covariance_agrees_with_the_written_out_formula() -> None:
    generator = np.random.default_rng(5)
    samples, joints, b = 120, 2, 3
    z, x = generator.normal(size=(2, samples, joints, b))
    sigma = np.array([0.5, 2.0])
    errors = Whitening("ar", (np.array([0.8]), np.array([0.3, 0.2])), np.array([0.4, 1.5]))
    segment = np.repeat([0, 1], samples // 2)
    cross, score = np.zeros((b, b)), np.zeros((b, b))
    for joint in range(joints):
        gamma = arma_acovf(np.r_[1.0, -errors.coefficients[joint]], [1.0], samples, errors.sigma[joint] ** 2)
        full = gamma[np.abs(np.subtract.outer(np.arange(samples), np.arange(samples)))]
        full = full * (segment[:, np.newaxis] == segment)
        zj = z[:, joint] / sigma[joint] ** 2
        cross += zj.T @ x[:, joint]
        score += zj.T @ full @ zj
    inverse = np.linalg.inv(cross)
    expected = inverse @ score @ inverse.T
    assert instrumental_covariance(z, x, sigma, errors, segment) == pytest.approx(expected, rel=1e-4)


def test_sigma_is_honest_under_correlated_errors() -> None:
    # 200 replicates: the spread of the estimates is what the AR covariance says, and not what i.i.d. says.
    samples, b = 400, 2
    time = np.linspace(0, 20, samples)
    x = np.column_stack([np.sin(time), np.ones(samples)])[:, np.newaxis, :]
    estimates, claimed, independent = [], [], []
    segment = np.zeros(samples, dtype=np.int64)
    for seed in range(200):
        error = autoregressive([0.8], samples, 1, seed)
        y = (x[:, 0] @ [1.0, 2.0])[:, np.newaxis] + error
        fit = sm.OLS(y, x[:, 0]).fit()
        residual = fit.resid[:, np.newaxis]
        errors = autoregressive_whitening(residual, segment, np.ones((samples, 1), dtype=np.bool_), b)
        sigma = np.array([residual.std()])
        estimates.append(fit.params)
        claimed.append(np.diag(instrumental_covariance(x, x, sigma, errors, segment)))
        independent.append(fit.bse**2)
    ratio = np.mean(claimed, axis=0) / np.var(estimates, axis=0)
    assert np.all((ratio > 0.7) & (ratio < 1.35))
    assert np.all(np.mean(independent, axis=0) / np.var(estimates, axis=0) < 0.3)
