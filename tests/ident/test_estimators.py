"""Estimates and covariances against linearmodels and statsmodels on the same matrices."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from linearmodels.iv import IV2SLS

from ident.errors import IdentificationError
from ident.estimators import Stacked, instrumental_variables, joint_deviations, weighted_least_squares
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
