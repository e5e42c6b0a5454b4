"""Huber's estimator against statsmodels' RLM, and what it is for."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm

from ident.estimators import Stacked, huber_least_squares, weighted_least_squares
from ident.estimators.robust import RobustFit

NAMES = ("a", "b", "c")
TRUTH = np.array([1.0, -2.0, 0.5])


def spoiled(joints: int = 1, samples: int = 500) -> Stacked:
    """Five per cent of the rows hold a contact: a large, one-sided force that goes with the regressor."""
    generator = np.random.default_rng(11)
    x = generator.normal(size=(joints * samples, 3))
    scale = np.repeat([0.2, 3.0][:joints], samples)
    y = x @ TRUTH + scale * generator.normal(size=joints * samples)
    hit = generator.random(y.size) < 0.05
    y[hit] += 20 * scale[hit] * np.sign(x[hit, 1])
    return Stacked(y, x, np.repeat(np.arange(joints), samples))


def test_one_joint_is_statsmodels_rlm() -> None:
    stacked = spoiled()
    fit = huber_least_squares(stacked, NAMES)
    model = sm.RLM(stacked.y, stacked.x, M=sm.robust.norms.HuberT(t=1.345))
    reference = model.fit(conv="coefs", tol=1e-10, maxiter=500)
    assert fit.converged
    assert fit.beta == pytest.approx(reference.params, rel=1e-7)
    assert fit.sigma[0] == pytest.approx(reference.scale, rel=1e-6)
    assert fit.weights == pytest.approx(reference.weights, abs=1e-6)
    assert fit.covariance == pytest.approx(reference.bcov_scaled, rel=1e-6)


def test_contacts_bias_least_squares_and_not_hubers() -> None:
    stacked = spoiled(joints=2)
    robust, plain = huber_least_squares(stacked, NAMES), weighted_least_squares(stacked, NAMES)
    assert np.max(np.abs(robust.beta - TRUTH)) < 0.03
    assert np.max(np.abs(plain.beta - TRUTH)) > 0.1
    assert robust.sigma == pytest.approx([0.2, 3.0], rel=0.2)


def test_spikes_are_what_weighs_less() -> None:
    fit = huber_least_squares(spoiled(joints=2), NAMES)
    assert isinstance(fit, RobustFit)
    # Five per cent spoiled, and 17 % of normal errors lie beyond 1.345 σ.
    assert 0.15 < fit.share_down_weighted() < 0.3
    assert np.mean(fit.weights < 0.2) == pytest.approx(0.05, abs=0.02)


def test_a_high_threshold_is_weighted_least_squares() -> None:
    stacked = spoiled()
    beta = np.linalg.lstsq(stacked.x, stacked.y, rcond=None)[0]
    assert huber_least_squares(stacked, NAMES, threshold=1e6).beta == pytest.approx(beta, rel=1e-10)
