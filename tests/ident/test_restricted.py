"""AR errors by restricted likelihood: against the likelihood written out, and free of the residuals' bias."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter
from scipy.stats import chi2

from ident.restricted import regression_whitening
from ident.whitening import autoregressive_whitening, ljung_box
from robots.arrays import BoolArray, FloatArray, IntArray

SAMPLES, COLUMNS, PHI = 400, 16, 0.8


def errors(seed: int, joints: int = 1) -> FloatArray:
    shocks = np.random.default_rng(seed).normal(size=(SAMPLES + 100, joints))
    return np.asarray(lfilter([1.0], [1.0, -PHI], shocks, axis=0)[100:])


def slow_columns(joints: int = 1) -> FloatArray:
    """Harmonics: samples × joints × columns, what a smooth motion makes of a regressor."""
    phase = np.pi * np.outer((np.arange(SAMPLES) + 0.5) / SAMPLES, np.arange(COLUMNS))
    return np.repeat(np.cos(phase)[:, np.newaxis, :], joints, axis=1)


def whole(joints: int = 1) -> tuple[IntArray, BoolArray]:
    return np.zeros(SAMPLES, dtype=np.int64), np.ones((SAMPLES, joints), dtype=np.bool_)


def restricted_phi(y: FloatArray, x: FloatArray) -> float:
    """The maximum of the restricted likelihood of an AR(1), with dense matrices, profiled over σ."""

    def negative(phi: float) -> float:
        gamma = toeplitz(phi ** np.arange(y.size)) / (1.0 - phi**2)
        inverse = np.linalg.inv(gamma)
        information = x.T @ inverse @ x
        residual = y - x @ np.linalg.solve(information, x.T @ inverse @ y)
        freedom = y.size - x.shape[1]
        variance = residual @ inverse @ residual / freedom
        determinants = np.linalg.slogdet(gamma)[1] + np.linalg.slogdet(information)[1]
        return float(freedom * np.log(variance) + determinants)

    return float(minimize_scalar(negative, bounds=(0.3, 0.99), method="bounded").x)


@pytest.mark.parametrize("seed", range(4))
def test_it_is_the_maximum_of_the_restricted_likelihood(seed: int) -> None:
    segment, used = whole()
    y, x = errors(seed), slow_columns()
    found = regression_whitening(y, x, segment, used).coefficients[0]
    assert found.size == 1
    # The first row has no row before it: the likelihood here is conditional on it.
    assert found[0] == pytest.approx(restricted_phi(y[:, 0], x[:, 0]), abs=0.01)


def test_columns_take_slow_errors_with_them_and_the_model_knows() -> None:
    # 100 replicates of φ = 0.8, deviation 0.03 each: the mean is known to 0.003.
    segment, used = whole()
    x = slow_columns()
    basis, _ = np.linalg.qr(x[:, 0])
    plain, restricted = [], []
    for seed in range(100):
        y = errors(seed)
        residual = y - basis @ (basis.T @ y)
        plain.append(autoregressive_whitening(residual, segment, used, COLUMNS).coefficients[0].sum())
        restricted.append(regression_whitening(y, x, segment, used).coefficients[0].sum())
    assert np.mean(plain) < PHI - 0.06
    assert np.mean(restricted) == pytest.approx(PHI, abs=0.015)


def test_residuals_of_any_estimate_give_the_same_model() -> None:
    segment, used = whole(2)
    y, x = errors(3, 2), slow_columns(2)
    shifted = y - x @ np.linspace(-1.0, 1.0, COLUMNS)
    one, other = (regression_whitening(values, x, segment, used) for values in (y, shifted))
    for a, b in zip(one.coefficients, other.coefficients, strict=True):
        assert a == pytest.approx(b, abs=1e-3)
    assert one.sigma == pytest.approx(other.sigma, rel=1e-3)


def test_dependent_columns_do_no_harm() -> None:
    segment, used = whole()
    y, x = errors(5), slow_columns()
    twice = np.concatenate([x, x[:, :, :5] @ np.ones((5, 1)), np.zeros_like(x[:, :, :1])], axis=2)
    one, other = (regression_whitening(y, columns, segment, used) for columns in (x, twice))
    assert one.coefficients[0] == pytest.approx(other.coefficients[0], abs=1e-3)


def test_what_is_left_is_said_to_be_white_or_not() -> None:
    segment, used = whole()
    x = slow_columns()
    whitening = regression_whitening(errors(6), x, segment, used)
    assert whitening.white_p is not None
    assert whitening.white_p[0] > 0.001
    assert "not quite white" not in whitening.describe()
    # A hum of 15 samples is nothing that an AR model with gaps in its rows can follow.
    used[::30] = False
    hum = errors(6) + 3.0 * np.sign(np.sin(2 * np.pi * np.arange(SAMPLES)[:, np.newaxis] / 15.5))
    coloured = regression_whitening(hum, x, segment, used)
    assert coloured.white_p is not None
    assert coloured.white_p[0] < 0.001
    assert "not quite white are joints 1" in coloured.describe()


def test_ljung_box_counts_the_fitted_coefficients() -> None:
    series = np.random.default_rng(7).normal(size=SAMPLES)
    statistic, p = ljung_box(series, 10, 3)
    assert p == pytest.approx(float(chi2.sf(statistic, 7)))
    assert statistic == ljung_box(series, 10)[0]
