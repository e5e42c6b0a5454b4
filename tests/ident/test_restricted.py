"""AR errors of a regression: against expectations and likelihood written out, and free of residuals' bias."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter
from scipy.stats import chi2

from ident.statistics.restricted import _model, independent_whitening, regression_whitening
from ident.statistics.toeplitz import forms, spectrum
from ident.statistics.whitening import autoregressive_whitening, ljung_box
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
def test_it_is_about_the_maximum_of_the_restricted_likelihood(seed: int) -> None:
    segment, used = whole()
    y, x = errors(seed), slow_columns()
    whitening = regression_whitening(y, x, segment, used)
    found = whitening.coefficients[0]
    assert found.size == 1
    assert whitening.sigma[0] == pytest.approx(1.0, abs=0.15)  # of the shocks; four deviations
    # The same to first order; an estimate has a deviation of 0.03.
    assert found[0] == pytest.approx(restricted_phi(y[:, 0], x[:, 0]), abs=0.02)


def test_residuals_are_as_large_and_as_correlated_as_the_model_says_they_should_be() -> None:
    # Two joints that share β, a gap in one of them, two recordings: every term of E(rrᵀ) with dense matrices.
    segment, used = whole(2)
    segment[SAMPLES // 2 :] = 1
    used[50:60, 1] = False
    generator = np.random.default_rng(8)
    x = np.concatenate(
        [slow_columns(2) * generator.uniform(-1.0, 1.0, size=(1, 2, COLUMNS)) for _ in "ab"], 2
    )
    y = errors(4, 2) * np.array([1.0, 5.0])
    omega = independent_whitening(y, x, segment, used).sigma
    model = regression_whitening(y, x, segment, used)
    rows = [(t, j) for j in range(2) for t in range(SAMPLES) if used[t, j]]
    columns = np.array([x[t, j] / omega[j] for t, j in rows])
    hat = np.eye(len(rows)) - columns @ np.linalg.pinv(columns)
    gamma = np.zeros((len(rows), len(rows)))
    for a, (t, j) in enumerate(rows):
        for b, (s, k) in enumerate(rows):
            if j == k and segment[t] == segment[s]:
                phi = model.coefficients[j][0]
                gamma[a, b] = (model.sigma[j] / omega[j]) ** 2 * phi ** abs(t - s) / (1 - phi**2)
    expected = hat @ gamma @ hat
    residual = hat @ np.array([y[t, j] / omega[j] for t, j in rows])
    place = {row: index for index, row in enumerate(rows)}
    for joint in range(2):
        assert model.coefficients[joint].size == 1
        phi = model.coefficients[joint][0]
        # Rows that count have six before them: residuals ask for two orders, and four more are tried.
        count = [t for t in range(6, SAMPLES) if all((t - k, joint) in place for k in range(7))]
        count = [t for t in count if segment[t - 6] == segment[t]]
        now, before = ([place[t - k, joint] for t in count] for k in range(2))
        squares = float(residual[before] @ residual[before])
        found = float(residual[now] @ residual[before]) - phi * squares
        wanted = float(expected[now, before].sum()) - phi * float(expected[before, before].sum())
        assert found == pytest.approx(wanted, abs=1e-3 * squares)
        assert abs(wanted) > 0.01 * squares  # what the columns take is not nothing


def test_noise_in_the_columns_does_not_make_the_model_a_random_walk() -> None:
    # The column of an inertia: slow motion, and the noise of two derivatives on top of it.
    generator = np.random.default_rng(9)
    motion = 20.0 * np.sin(2 * np.pi * np.arange(2000) / 200.0)
    noise = np.diff(generator.normal(size=2002), n=2)
    x = np.column_stack([motion + noise, np.ones(2000)])[:, np.newaxis, :]
    error = lfilter([1.0], [1.0, -PHI], generator.normal(size=2000))
    segment, used = np.zeros(2000, dtype=np.int64), np.ones((2000, 1), dtype=np.bool_)
    found = regression_whitening((motion + error)[:, np.newaxis], x, segment, used)
    assert 0.4 < found.coefficients[0].sum() < 0.9


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


def test_constant_columns_between_gaps_do_not_run_away() -> None:
    # Ten short runs, each with friction of its own sign: at a unit root nothing but differences would speak
    # of offset and Coulomb friction, and a likelihood without the runs' first rows has its maximum there.
    found = []
    for seed in range(20):
        segment, used = whole()
        used[::40] = False
        x = np.ones((SAMPLES, 1, 4))
        x[:, 0, 1] = np.sign(np.sin(2 * np.pi * (np.arange(SAMPLES) + 0.5) / 80.0))
        x[:, 0, 2:] = slow_columns()[:, 0, 3:5]
        found.append(regression_whitening(errors(seed), x, segment, used).coefficients[0].sum())
    assert np.mean(found) == pytest.approx(PHI, abs=0.03)
    assert max(found) < 0.95


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


def test_a_correction_that_takes_more_than_there_is_is_left_out() -> None:
    """One period with sticking friction (rows without a gap behind them, a slow process) ended in a crash."""
    gamma = PHI ** np.arange(4) / (1.0 - PHI**2)
    products = SAMPLES * toeplitz(gamma)
    plain = _model([products], [np.zeros((4, 4))], [SAMPLES])
    left_out = _model([products], [-1.5 * products], [SAMPLES])
    assert left_out.coefficients[0] == pytest.approx([PHI])
    assert left_out.coefficients[0] == pytest.approx(plain.coefficients[0])
    assert left_out.sigma == pytest.approx(plain.sigma)
    taken = _model([products], [0.5 * products], [SAMPLES])
    assert taken.sigma[0] == pytest.approx(np.sqrt(1.5) * plain.sigma[0])


@pytest.mark.parametrize("samples", [1, 7, 20, 33])
def test_quadratic_forms_are_those_of_the_matrix(samples: int) -> None:
    generator = np.random.default_rng(samples)
    gamma, series = generator.normal(size=samples), generator.normal(size=(samples, 3))
    expected = np.diag(series.T @ toeplitz(gamma) @ series)
    assert forms(gamma, spectrum(series)) == pytest.approx(expected, abs=1e-12)
