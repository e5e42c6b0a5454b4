"""The printed interval: errors with gaps, a lag that is off, friction that turns round in its own way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import butter, lfilter, sosfiltfilt

import robots
from benchmarks.closed_loop_runs import motion, noisy_truth, record
from daq.cli.demonstration import true_base_parameters
from ident import Fitted, Recording, identify
from ident.identification.intervals import QUANTILE, _settled, _turns
from ident.statistics.covariance import autocovariance
from ident.statistics.lag_window import _windowed, memory_of, variances, windowed_autocovariance
from ident.statistics.restricted import regression_whitening
from robots import Robot
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Identification

SAMPLES = 1200
TIME = np.arange(SAMPLES) / 100.0


def gaps() -> BoolArray:
    """One row in eight left out, as around reversals."""
    return np.asarray((np.arange(SAMPLES) % 40 >= 5)[:, np.newaxis])


def band_limited(seed: int) -> FloatArray:
    """White noise behind a low-pass at 40 of 50 Hz, as torque is."""
    white = np.random.default_rng(seed).normal(size=SAMPLES + 400)
    return np.asarray(sosfiltfilt(butter(4, 0.6, output="sos"), white)[200:-200])


def columns() -> FloatArray:
    """samples × 1 × 3."""
    slow = np.column_stack([np.sin(1.3 * TIME), np.sign(np.sin(2.0 * TIME)), np.ones(SAMPLES)])
    return slow[:, np.newaxis]


def deviations_of(process: str, target: FloatArray, used: BoolArray, segment: IntArray) -> FloatArray:
    """Variances (3,) that a least-squares estimate is said to have."""
    x = columns()
    flat = (x * used[:, :, np.newaxis])[:, 0]
    weights = (flat @ np.linalg.inv(flat.T @ flat))[:, np.newaxis]
    if process == "window":
        return variances(weights, windowed_autocovariance(target, x, segment, used), segment)
    found = regression_whitening(target, x, segment, used)
    gamma = autocovariance(found.coefficients[0], float(found.sigma[0]), SAMPLES)
    return variances(weights, (gamma,), segment)


@pytest.mark.parametrize("kind", ["edge", "memory", "white"])
def test_variances_are_those_of_the_estimates_whatever_the_errors_remember(kind: str) -> None:
    """Over 60 draws, with gaps and two recordings. An AR process has too low an order there for an edge."""
    used, segment = gaps(), np.repeat([0, 1], SAMPLES // 2)
    flat = (columns() * used[:, :, np.newaxis])[:, 0]
    inverse = np.linalg.inv(flat.T @ flat)
    estimates, claimed, short = [], [], []
    for seed in range(60):
        white = np.random.default_rng(seed).normal(size=SAMPLES + 200)
        errors = {"edge": band_limited(seed), "memory": lfilter([1.0], [1.0, -0.6], white)[200:]}
        y = errors.get(kind, white[200:])[:, np.newaxis]
        estimates.append(inverse @ flat.T @ y[:, 0])
        claimed.append(deviations_of("window", y, used, segment))
        if kind == "edge":
            short.append(deviations_of("ar", y, used, segment))
    spread = np.var(estimates, axis=0)
    # Each of three variances is known to 18 % from 60 draws.
    assert np.mean(np.mean(claimed, axis=0) / spread) == pytest.approx(1.0, abs=0.2)
    if kind == "edge":
        assert np.mean(np.mean(short, axis=0) / spread) < 0.75


def test_a_tail_that_no_correlogram_shows_is_part_of_the_variance() -> None:
    """AR(1) of 0.67 on 500 rows: four lags show, the window without prewhitening leaves a tenth out."""
    root, rows = 0.67, 500.0
    gamma = root ** np.arange(120.0)
    found = _windowed(gamma, rows)
    assert 2.0 * found.sum() - found[0] == pytest.approx((1.0 + root) / (1.0 - root), rel=0.01)
    assert found == pytest.approx(gamma, abs=1e-6)
    cut = gamma * np.clip(2.0 - np.arange(120) / memory_of(gamma, rows), 0.0, 1.0)
    assert 2.0 * cut.sum() - cut[0] < 0.92 * (1.0 + root) / (1.0 - root)


@pytest.mark.parametrize("root", [0.0, 0.5, -0.4])
def test_an_autocovariance_that_ends_is_found_as_it_is(root: float) -> None:
    """ARMA(1, 1): what an AR(1) leaves of it has a lag or two."""
    shocks, answer = np.array([1.0, 0.6]), root ** np.arange(150.0)
    series = np.convolve(shocks, answer)[:150]
    gamma = np.array([series[: 150 - k] @ series[k:] for k in range(80)])
    assert _windowed(gamma, 1e6) == pytest.approx(gamma, abs=5e-3)


def test_the_memory_ends_before_five_quiet_lags() -> None:
    """Of 1000 rows a lag is quiet below 2·√(3/1000) = 0.1095."""
    correlation = np.array([1.0, 0.5, 0.11, 0.1, 0.0, -0.1, 0.1, 0.1, 0.1])
    assert memory_of(correlation, 1000.0) == 2
    late = np.array([1.0, 0.5, 0.0, 0.0, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert memory_of(late, 1000.0) == 6
    assert memory_of(np.full(8, 0.5), 1000.0) == 7
    assert memory_of(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 1000.0) == 0


def test_variances_written_out() -> None:
    weights = np.random.default_rng(3).normal(size=(12, 2, 2))
    segment = np.repeat([0, 1], 6)
    gamma = (np.array([2.0, 1.0, 0.5]), np.array([3.0]))
    expected = np.zeros(2)
    for joint, covariance in enumerate(gamma):
        whole = toeplitz(np.concatenate([covariance, np.zeros(12 - covariance.size)]))
        whole = whole * (segment[:, np.newaxis] == segment)
        expected += np.diag(weights[:, joint].T @ whole @ weights[:, joint])
    assert variances(weights, gamma, segment) == pytest.approx(expected, rel=1e-10)


# The interval


def axis(**changes: object) -> Robot:
    robot = robots.load("emps")
    settings: dict[str, object] = {
        "cutoff_hz": 40.0,
        "decimation": 10,
        "covariance": "ar",
        "trim_samples": (100, 100),
        "minimum_speed": 0.0,
        "standstill_margin": 0.0,
        "friction_sign": "tanh",
        "friction_width": 1e-4,
        "control_signal_lag": 0.0005,
        "torque_filter": "positions",
    }
    identification = robot.identification.model_copy(update=settings | changes)
    return robot.model_copy(update={"identification": identification})


@pytest.fixture(scope="module")
def recording() -> Recording:
    robot = robots.load("emps")
    return record(robot, noisy_truth(robot, 1, 10.0, 5), motion(robot, 6.0, 3))


def half_widths(fitted: Fitted) -> FloatArray:
    return np.array([p.half_width for p in fitted.result.least_squares.parameters], dtype=np.float64)


def test_rows_near_reversals_widen_the_interval_and_rows_away_do_not(recording: Recording) -> None:
    near = identify(axis(), (recording,))
    ratio = half_widths(near) / QUANTILE / np.sqrt(np.diag(near.least_squares.covariance))
    # The friction of the bench turns round over a distance, the model's jumps: 2 σ of bias without the term.
    assert np.all(ratio > 1.1)
    away = identify(axis(minimum_speed=0.02, standstill_margin=0.3), (recording,))
    ratio = half_widths(away) / QUANTILE / np.sqrt(np.diag(away.least_squares.covariance))
    assert ratio == pytest.approx([1.0] * 4, abs=0.1)
    named = true_base_parameters(near.base, noisy_truth(robots.load("emps"), 1))
    truth = np.array([named[name] for name in near.base.names])
    assert np.all(np.abs(near.least_squares.beta - truth) < half_widths(near))


def test_kept_rows_know_nothing_of_reversals_behind_the_default_filter() -> None:
    """A weak motion behind 20 Hz without noise; a filter that rings carries reversals into all rows."""
    robot = robots.load("emps")
    home = np.array(robot.home)
    truth = replace(noisy_truth(robot, 1, 0.0, 7), torque_noise=(0.0,))
    quiet = record(robot, truth, home + 0.2 * (motion(robot, 6.0, 3) - home))
    settings = axis(cutoff_hz=20.0, decimation=20, minimum_speed=0.01, standstill_margin=0.04).identification

    def off(**filters: str) -> float:
        """Largest relative error of a parameter."""
        values = settings.model_dump(exclude={"decimation_filter"}) | filters
        arm = robot.model_copy(update={"identification": Identification.model_validate(values)})
        fitted = identify(arm, (quiet,), options=replace_method("ls"))
        named = true_base_parameters(fitted.base, truth)
        right = np.array([named[name] for name in fitted.base.names])
        return float(np.abs(fitted.least_squares.beta / right - 1.0).max())

    assert off() < 0.002
    assert off(decimation_filter="chebyshev") > 0.02


def test_a_lag_that_nobody_stated_widens_the_interval_of_what_it_reads_as(recording: Recording) -> None:
    """An unknown lag is doubted more than a given one; a lag that was found by its own variance."""
    settings = {"minimum_speed": 0.02, "standstill_margin": 0.3}
    given = identify(axis(**settings), (recording,))
    unknown = identify(axis(**settings, control_signal_lag=0.0), (recording,))
    found = identify(axis(**settings, alignment="estimate"), (recording,))
    signals = found.result.signals
    assert signals is not None
    assert signals.lag_sigma is not None
    extra = {
        name: half_widths(fitted) ** 2 / QUANTILE**2 - np.diag(fitted.least_squares.covariance)
        for name, fitted in (("given", given), ("unknown", unknown), ("found", found))
    }
    assert np.all(extra["unknown"] > extra["given"])
    viscous = given.base.names.index("Fv1")
    # Of a lag that was found its own variance is what is doubted.
    assert extra["found"][viscous] > 10.0 * extra["given"][viscous]


def test_published_deviations_stay_as_they_are_and_the_interval_has_the_memory(recording: Recording) -> None:
    block = identify(axis(covariance="block", minimum_speed=0.02, standstill_margin=0.3), (recording,))
    memory = identify(axis(minimum_speed=0.02, standstill_margin=0.3), (recording,))
    assert half_widths(block) == pytest.approx(half_widths(memory), rel=1e-6)
    assert not np.allclose(block.least_squares.covariance, memory.least_squares.covariance, rtol=0.05)


def test_other_estimators_have_no_interval(recording: Recording) -> None:
    fitted = identify(axis(), (recording,), options=replace_method("robust"))
    robust = fitted.result.by_estimator["robust"]
    assert all(parameter.half_width is None for parameter in robust.parameters)


def replace_method(method: str) -> object:
    from ident.identification.options import Options

    return replace(Options(), method=method)  # type: ignore[arg-type]


# What is near a reversal


def test_turns_are_where_the_sign_changes() -> None:
    velocity = np.array([[1.0, -1.0], [2.0, -1.0], [-1.0, 0.0], [-1.0, 0.0], [1.0, 2.0]])
    turns = [[0, 0], [0, 0], [1, 1], [0, 0], [1, 1]]
    assert _turns(velocity).astype(int).tolist() == turns


def test_a_lower_cut_off_takes_as_much_longer_to_settle() -> None:
    settings = robots.load("emps").identification
    samples = {
        hz: _settled(settings.model_copy(update={"cutoff_hz": hz, "filter_order": 4}), 1e-3)
        for hz in (10.0, 20.0, 40.0)
    }
    assert samples[10.0] == pytest.approx(2 * samples[20.0], abs=2)
    assert samples[20.0] == pytest.approx(2 * samples[40.0], abs=2)
    # The slowest pair of poles decays with ω·sin 22.5°: gone to 1 % after some 4.5 time constants.
    assert samples[10.0] == pytest.approx(1e3 * 4.5 / (2 * np.pi * 10.0 * np.sin(np.pi / 8)), rel=0.4)
