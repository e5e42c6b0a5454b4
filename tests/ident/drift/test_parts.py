"""Pieces of the comparison written out: torque of a change, a drive's gain, warmth, what moves together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from ident import RegressorModel, base_parameters
from ident.drift.geometry import Geometry, geometry_of
from ident.drift.run_to_run import recursive_residuals, run_to_run_covariance, temperature_slopes
from ident.drift.wald import holm, solve_covariance, wald_test
from ident.preparation.observation import Rows
from robots.arrays import FloatArray


@pytest.fixture(scope="module")
def rows() -> Rows:
    """Random rows of a coupled arm, some left out."""
    base = base_parameters(RegressorModel.of(robots.load("tx40")))
    generator = np.random.default_rng(3)
    x = generator.normal(size=(120, 6, len(base.names)))
    used = generator.random((120, 6)) < 0.9
    time = np.arange(120) / 100.0
    return Rows(time, np.zeros(120, dtype=np.int64), generator.normal(size=(120, 6)), x, used)


@pytest.fixture(scope="module")
def geometry(rows: Rows) -> Geometry:
    base = base_parameters(RegressorModel.of(robots.load("tx40")))
    generator = np.random.default_rng(4)
    sigma, beta = generator.uniform(0.5, 3.0, 6), generator.normal(size=len(base.names))
    return geometry_of(base, rows, sigma, beta)


def test_the_torque_of_a_change_is_that_of_the_rows(geometry: Geometry, rows: Rows) -> None:
    change = np.random.default_rng(5).normal(size=geometry.beta.size)
    torque = np.where(rows.used, rows.regressor @ change, 0.0)
    assert geometry.joints == 6
    assert geometry.torque_rms(np.zeros_like(change)).tolist() == [0.0] * 6
    assert geometry.torque_rms(change) == pytest.approx(np.sqrt(np.mean(torque**2, axis=0)), rel=1e-10)


@pytest.mark.parametrize("drive", [1, 4, 5])
def test_a_drives_gain_is_what_least_squares_makes_of_it(geometry: Geometry, rows: Rows, drive: int) -> None:
    """Torques of the drives are T⁻ᵀτ; one of them twice as large, back at the joints, fitted by eq. 7."""
    x = np.where(rows.used[:, :, np.newaxis], rows.regressor, 0.0)
    transmission = geometry.base.model.robot.transmission_matrix
    of_drives = x @ geometry.beta @ np.linalg.inv(transmission)
    more = of_drives[:, [drive]] * transmission[drive]
    weight = 1.0 / geometry.sigma
    flat = (x * weight[:, np.newaxis]).reshape(-1, x.shape[2])
    expected = np.linalg.lstsq(flat, (more * weight).ravel(), rcond=None)[0]
    assert geometry.gain_direction(drive) == pytest.approx(expected, rel=1e-8, abs=1e-10)
    twice = replace(geometry, beta=2.0 * geometry.beta)
    assert twice.gain_direction(drive) == pytest.approx(2.0 * expected, rel=1e-8, abs=1e-10)


# Nights


def nights(count: int = 12) -> tuple[FloatArray, FloatArray]:
    generator = np.random.default_rng(6)
    celsius = generator.normal(20.0, 4.0, count)
    return generator.normal(size=(count, 3)) + 0.5 * celsius[:, np.newaxis] * [1.0, 0.0, -2.0], celsius


def test_slopes_over_temperature_are_drawn_towards_the_prior() -> None:
    values, celsius = nights()
    apart = celsius - celsius.mean()
    plain = np.polyfit(celsius, values, 1)[0]
    assert temperature_slopes(values, celsius, np.zeros(3), 0.0) == pytest.approx(plain, rel=1e-9)
    weight = float(apart @ apart)  # as much as the nights
    prior = np.array([4.0, 0.0, -4.0])
    assert temperature_slopes(values, celsius, prior, weight) == pytest.approx((plain + prior) / 2, rel=1e-9)
    assert temperature_slopes(values, None, prior, 1.0).tolist() == [0.0] * 3


def test_what_each_parameter_does_by_itself_is_its_variance_beyond_that_within() -> None:
    """Temperature is taken out with its degree of freedom; nothing moves together, so nothing is shared."""
    values, celsius = nights()
    within = np.diag([0.1, 0.2, 50.0])
    fits = np.polyfit(celsius, values, 1)
    left = values - np.outer(celsius, fits[0]) - fits[1]
    beyond = np.maximum(np.sum(left**2, axis=0) / 10 - np.diag(within), 0.0)
    assert beyond[2] == 0.0 < beyond[:2].min()
    assert run_to_run_covariance(values, within, celsius) == pytest.approx(np.diag(beyond), abs=1e-12)
    assert run_to_run_covariance(values, within, 0.02 * celsius) == pytest.approx(np.diag(beyond), abs=1e-12)
    constant = np.full(12, 20.0) + 1e-12 * celsius
    alone = run_to_run_covariance(values, 1e3 * within, None)
    assert run_to_run_covariance(values, 1e3 * within, constant) == pytest.approx(alone, rel=1e-12)


def test_what_moves_together_converges_to_the_factor_that_explains_it() -> None:
    """Six parameters with one strong factor: off its diagonal the covariance is that of the nights."""
    generator = np.random.default_rng(8)
    loading = np.array([3.0, 2.0, -2.0, 1.5, 1.0, -1.0])
    values = generator.normal(size=(4000, 1)) * loading + 0.5 * generator.normal(size=(4000, 6))
    found = run_to_run_covariance(values, 0.01 * np.eye(6), None)
    sample = np.cov(values.T) - 0.01 * np.eye(6)
    assert found - np.diag(np.diag(found)) == pytest.approx(sample - np.diag(np.diag(sample)), abs=0.05)
    assert np.diag(found) == pytest.approx(np.diag(sample), rel=0.03)
    # A parameter that the factor explains wholly keeps a twentieth of its variance to itself.
    exact = generator.normal(size=(400, 1)) * loading
    kept = run_to_run_covariance(exact, 1e-6 * np.eye(6), None)
    own = np.diag(kept) - np.diag(np.outer(loading, loading)) * np.var(exact[:, 0], ddof=1) / 9.0
    assert own / np.diag(np.cov(exact.T)) == pytest.approx([0.05] * 6, abs=0.03)


def test_leverage_and_freedom_of_a_night() -> None:
    """1/n + (c − c̄)²/Σ(c − c̄)² of the clean nights before it; n − 2 degrees of freedom; two teach no line."""
    values, celsius = nights()
    clean = np.ones(12, dtype=np.bool_)
    clean[4] = False
    found = recursive_residuals(values, celsius, clean)
    before = celsius[:9][clean[:9]]
    expected = 1 / 8 + (celsius[9] - before.mean()) ** 2 / np.sum((before - before.mean()) ** 2)
    assert found.leverage[9] == pytest.approx(expected, rel=1e-8)
    assert found.df[9] == 6.0 and found.df[3] == 1.0
    assert np.isnan(found.scale[:3]).all() and np.isfinite(found.scale[3:]).all()
    line = np.polyfit(before, values[:9][clean[:9]], 1)
    error = (values[9] - line[0] * celsius[9] - line[1]) / np.sqrt(1 + expected)
    assert found.error[9] == pytest.approx(error, rel=1e-8)
    left = values[:9][clean[:9]] - np.outer(before, line[0]) - line[1]
    assert found.scale[9] == pytest.approx(np.sqrt(np.sum(left**2, axis=0) / 6), rel=1e-6)
    alone = recursive_residuals(values, None, clean)
    assert alone.leverage[9] == pytest.approx(1 / 8) and alone.df[9] == 7.0
    assert recursive_residuals(values, None, np.zeros(12, dtype=np.bool_)).df.tolist() == [0.0] * 12


# Tests


def test_holms_values_by_hand() -> None:
    assert holm(np.array([0.02, 0.3, 0.01, 0.02])) == pytest.approx([0.06, 0.3, 0.04, 0.06])
    assert holm(np.array([0.9, 0.8])).tolist() == [1.0, 1.0]


def test_covariances_of_any_unit_are_solved_with() -> None:
    root = np.random.default_rng(9).normal(size=(3, 3)) * [1e-8, 1.0, 1e8]
    right = np.random.default_rng(10).normal(size=(3, 2))
    found = solve_covariance(root.T @ root, right)
    scale = np.array([1e-8, 1.0, 1e8])
    expected = (
        np.linalg.solve(root.T @ root / np.outer(scale, scale), right / scale[:, None]) / scale[:, None]
    )
    assert found == pytest.approx(expected, rel=1e-6)


def test_walds_words_and_freedom() -> None:
    new, old = np.array([3.0, 1.0]), np.array([1.0, 1.0])
    found = wald_test(new, old, np.diag([2.0, 9.0]), name="n", null="z")
    assert found.statistic == pytest.approx(2.0)
    assert (found.name, found.null, found.distribution, found.df) == ("n", "z", "χ²(2)", (2,))
    as_f = wald_test(new, old, np.diag([2.0, 9.0]), name="n", null="z", runs=5)
    assert as_f.statistic == pytest.approx(1.0)
    assert (as_f.distribution, as_f.df) == ("F(2, 4)", (2.0, 4.0))


@pytest.mark.parametrize(("together", "common"), [(0.06, False), (0.09, True)])
def test_what_moves_together_begins_where_chance_ends(together: float, common: bool) -> None:
    """Four parameters, 400 nights, an exact sample correlation: largest eigenvalue 1 + 3ρ, edge 1.21."""
    rng = np.random.default_rng(8)
    scores = rng.normal(size=(400, 4))
    scores -= scores.mean(axis=0)
    white = scores @ np.linalg.inv(np.linalg.cholesky(scores.T @ scores / 399)).T
    correlation = np.full((4, 4), together) + (1.0 - together) * np.eye(4)
    values = 5.0 + white @ np.linalg.cholesky(correlation).T
    edge = (1.0 + np.sqrt(4 / 399)) ** 2
    assert (1.0 + 3.0 * together > edge) == common
    found = run_to_run_covariance(values, 1e-9 * np.eye(4), None)
    apart = found[~np.eye(4, dtype=bool)]
    assert np.diag(found) == pytest.approx(np.ones(4), rel=0.05)
    assert (np.abs(apart).max() > 0.02) == common
    assert common or np.abs(apart).max() == 0.0


def test_what_is_correlated_within_a_run_does_not_move_together_between_runs() -> None:
    """Six parameters that no run tells apart well, and nights that differ by nothing else."""
    within = 0.1 * np.eye(6) + 0.9
    root = np.linalg.cholesky(within)
    values = np.random.default_rng(0).normal(size=(400, 6)) @ root.T
    found = run_to_run_covariance(values, within, None)
    assert found == pytest.approx(np.diag(np.diag(found)), abs=1e-12)
    assert np.diag(found).max() < 0.2
    loading = np.array([3.0, -3.0, 3.0, -3.0, 3.0, -3.0])
    together = values + np.random.default_rng(13).normal(size=(400, 1)) * loading
    moved = run_to_run_covariance(together, within, None)
    assert moved[0, 1] == pytest.approx(-9.0, rel=0.15)
