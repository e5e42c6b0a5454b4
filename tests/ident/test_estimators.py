"""Estimates and covariances against linearmodels and statsmodels on the same matrices."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from linearmodels.iv import IV2SLS

from ident.errors import IdentificationError
from ident.estimators import Stacked, instrumental_variables, joint_deviations, weighted_least_squares
from ident.estimators.least_squares import require_full_rank
from ident.estimators.two_stage import two_stage_least_squares
from robots.arrays import FloatArray

NAMES = ("a", "b", "c")


def problem(seed: int = 0, samples: int = 300) -> tuple[Stacked, FloatArray]:
    """Two joints with different noise, regressors correlated with it, and valid instruments."""
    generator = np.random.default_rng(seed)
    z = generator.normal(size=(2 * samples, 3))
    noise = np.repeat([0.2, 3.0], samples) * generator.normal(size=2 * samples)
    x = z + 0.3 * generator.normal(size=z.shape)
    x[:, 1] += 0.2 * noise
    return Stacked(x @ [1.0, -2.0, 0.5] + noise, x, np.repeat([0, 1], samples)), z


def test_weighted_least_squares_is_statsmodels_wls() -> None:
    stacked, _ = problem()
    fit = weighted_least_squares(stacked, NAMES)
    weights = np.repeat(1 / fit.sigma**2, 300)
    reference = sm.WLS(stacked.y, stacked.x, weights=weights).fit(cov_type="fixed scale")
    assert fit.beta == pytest.approx(reference.params, rel=1e-10)
    assert fit.covariance == pytest.approx(reference.cov_params(), rel=1e-8)


def test_joint_deviation_is_the_residual_deviation_of_each_joints_ols() -> None:
    stacked, _ = problem()
    expected = [
        np.sqrt(sm.OLS(stacked.y[part], stacked.x[part]).fit().mse_resid)
        for part in (slice(0, 300), slice(300, 600))
    ]
    assert joint_deviations(stacked) == pytest.approx(expected, rel=1e-10)


def test_instrumental_variables_is_linearmodels_iv2sls() -> None:
    stacked, z = problem()
    one = np.array([1.0, 1.0])
    fit = instrumental_variables(stacked, z, one)
    reference = IV2SLS(stacked.y, None, stacked.x, z).fit(cov_type="unadjusted")
    assert fit.beta == pytest.approx(reference.params.to_numpy(), rel=1e-10)


def test_instrumental_covariance_on_one_joint_is_that_of_linearmodels() -> None:
    stacked, z = problem()
    alone = Stacked(stacked.y[:300], stacked.x[:300], np.zeros(300, dtype=np.int64))
    fit = instrumental_variables(alone, z[:300], np.array([1.0]))
    reference = IV2SLS(alone.y, None, alone.x, z[:300]).fit(cov_type="unadjusted", debiased=True)
    assert fit.covariance == pytest.approx(reference.cov.to_numpy(), rel=1e-8)


def test_instruments_remove_the_bias_that_least_squares_has() -> None:
    stacked, z = problem(samples=20000)
    sigma = joint_deviations(stacked)
    instrumental = instrumental_variables(stacked, z, sigma)
    least_squares = weighted_least_squares(stacked, NAMES)
    truth = np.array([1.0, -2.0, 0.5])
    assert np.all(np.abs(instrumental.beta - truth) < 4 * np.sqrt(np.diag(instrumental.covariance)))
    assert np.any(np.abs(least_squares.beta - truth) > 10 * np.sqrt(np.diag(least_squares.covariance)))


def test_a_parameter_without_excitation_is_named() -> None:
    stacked, _ = problem()
    x = stacked.x.copy()
    x[:, 2] = 0.0
    with pytest.raises(IdentificationError, match="does not excite c;"):
        weighted_least_squares(Stacked(stacked.y, x, stacked.joint), NAMES)


def test_parameters_that_move_together_are_named() -> None:
    stacked, _ = problem()
    x = stacked.x.copy()
    x[:, 2] = 2.0 * x[:, 0]
    with pytest.raises(IdentificationError, match="does not tell apart a, c;"):
        weighted_least_squares(Stacked(stacked.y, x, stacked.joint), NAMES)


def test_a_torque_without_noise_is_suspicious() -> None:
    stacked, _ = problem()
    with pytest.raises(IdentificationError, match="joint 1: the torque is fitted without any error"):
        weighted_least_squares(Stacked(np.zeros_like(stacked.y), stacked.x, stacked.joint), NAMES)


def test_the_sample_deviation_divides_by_rows_less_one() -> None:
    stacked, _ = problem(samples=20)
    expected = [
        np.sqrt(sm.OLS(stacked.y[part], stacked.x[part]).fit().ssr / 19)
        for part in (slice(0, 20), slice(20, 40))
    ]
    assert joint_deviations(stacked, "sample") == pytest.approx(expected, rel=1e-10)
    assert weighted_least_squares(stacked, NAMES, "sample").sigma == pytest.approx(expected, rel=1e-10)


def test_columns_that_a_joint_does_not_feel_cost_it_no_freedom() -> None:
    stacked, _ = problem(samples=20)
    x = stacked.x.copy()
    x[:20, 2] = 0.0
    found = joint_deviations(Stacked(stacked.y, x, stacked.joint))
    assert found[0] == pytest.approx(np.sqrt(sm.OLS(stacked.y[:20], x[:20, :2]).fit().mse_resid), rel=1e-10)


@pytest.mark.parametrize("rows", [2, 3])
def test_as_many_rows_as_parameters_are_too_few(rows: int) -> None:
    stacked, _ = problem(samples=rows)
    with pytest.raises(IdentificationError, match=rf"^joint 1: {rows} rows for {rows} parameters; record"):
        joint_deviations(stacked)


def test_one_row_more_than_parameters_is_enough() -> None:
    assert np.all(joint_deviations(problem(samples=4)[0]) > 0.0)


def test_the_instrumental_covariance_of_two_joints_is_that_of_its_own_residuals() -> None:
    """(Z'WX)⁻¹ Z'W Ω W Z (X'WZ)⁻¹, W of the deviations that were given, Ω of the residuals."""
    stacked, z = problem(samples=40)
    given = np.array([0.5, 2.0])
    fit = instrumental_variables(stacked, z, given)
    w = np.repeat(given**-2.0, 40)[:, np.newaxis]
    beta = np.linalg.solve(z.T @ (w * stacked.x), z.T @ (w[:, 0] * stacked.y))
    residual = stacked.y - stacked.x @ beta
    omega = np.array([residual[part] @ residual[part] / (40 - 1.5) for part in (slice(0, 40), slice(40, 80))])
    score = (w * z).T @ (np.repeat(omega, 40)[:, np.newaxis] * w * z)
    inverse = np.linalg.inv(z.T @ (w * stacked.x))
    assert fit.beta == pytest.approx(beta, rel=1e-10)
    assert fit.sigma == pytest.approx(np.sqrt(omega), rel=1e-10)
    assert fit.covariance == pytest.approx(inverse @ score @ inverse.T, rel=1e-8)
    assert fit.condition == pytest.approx(np.linalg.cond(np.sqrt(w) * stacked.x), rel=1e-10)


def test_two_stages_of_two_joints_written_out() -> None:
    stacked, z = problem(samples=40)
    more = np.hstack([z, np.random.default_rng(9).normal(size=(80, 2))])
    given = np.array([0.5, 2.0])
    fit = two_stage_least_squares(stacked, more, given)
    w = np.repeat(given**-2.0, 40)[:, np.newaxis]
    projected = more @ np.linalg.solve(more.T @ (w * more), more.T @ (w * stacked.x))
    beta = np.linalg.solve(projected.T @ (w * projected), projected.T @ (w[:, 0] * stacked.y))
    residual = stacked.y - stacked.x @ beta
    omega = np.array([residual[part] @ residual[part] / (40 - 1.5) for part in (slice(0, 40), slice(40, 80))])
    inverse = np.linalg.inv(projected.T @ (w * projected))
    score = (w * projected).T @ (np.repeat(omega, 40)[:, np.newaxis] * w * projected)
    assert fit.beta == pytest.approx(beta, rel=1e-9)
    assert fit.projected == pytest.approx(projected, rel=1e-9)
    assert fit.sigma == pytest.approx(np.sqrt(omega), rel=1e-9)
    assert fit.covariance == pytest.approx(inverse @ score @ inverse, rel=1e-8)
    assert fit.condition == pytest.approx(np.linalg.cond(np.sqrt(w) * stacked.x), rel=1e-9)


def test_two_stages_need_instruments_that_move_every_regressor() -> None:
    stacked, z = problem(samples=40)
    given = np.array([0.5, 2.0])
    with pytest.raises(IdentificationError, match=r"^2 instruments for 3 parameters; at least as many"):
        two_stage_least_squares(stacked, z[:, :2], given)
    with pytest.raises(IdentificationError, match="do not move every regressor"):
        two_stage_least_squares(stacked, np.column_stack([z[:, :2], z[:, 0] + z[:, 1]]), given)
    assert two_stage_least_squares(stacked, z, given).beta == pytest.approx(
        instrumental_variables(stacked, z, given).beta, rel=1e-8
    )


def test_the_condition_is_that_of_the_weighted_columns() -> None:
    stacked, _ = problem()
    fit = weighted_least_squares(stacked, NAMES)
    weighted = stacked.x / np.repeat(fit.sigma, 300)[:, np.newaxis]
    assert fit.condition == pytest.approx(np.linalg.cond(weighted), rel=1e-10)


def test_which_parameters_are_not_told_apart() -> None:
    """Columns that depend on one another to 1e-11 of their size are; to 1e-9 they are not. A column that
    takes a hundredth of such a relation is not named."""
    generator = np.random.default_rng(2)
    x = np.linalg.qr(generator.normal(size=(60, 3)))[0]
    other = x.copy()
    other[:, 2] = 1e3 * (x[:, 0] + 0.01 * x[:, 1] + 2e-11 * x[:, 2])
    with pytest.raises(IdentificationError, match="does not tell apart a, c;"):
        require_full_rank(other, NAMES)
    other[:, 2] = 1e3 * (x[:, 0] + 0.01 * x[:, 1] + 2e-9 * x[:, 2])
    require_full_rank(other, NAMES)


@pytest.mark.parametrize(("angle", "told_apart"), [(1.7e-10, False), (2.3e-10, True)])
def test_singular_values_are_measured_by_the_largest(angle: float, told_apart: bool) -> None:
    """Two columns at a small angle φ and a third across: √2, 1 and φ/√2, so the limit is φ = 2e-10."""
    e = np.eye(4)
    x = np.column_stack([e[0], np.cos(angle) * e[0] + np.sin(angle) * e[1], e[2]])
    if told_apart:
        require_full_rank(x, ("a", "b", "c"))
    else:
        with pytest.raises(IdentificationError, match="does not tell apart a, b;"):
            require_full_rank(x, ("a", "b", "c"))
