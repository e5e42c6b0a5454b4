"""Huber's estimator and Tukey's biweight against statsmodels' RLM, and what they are for."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm

from ident.estimators import Stacked, weighted_least_squares
from ident.estimators.biweight import BIWEIGHT
from ident.estimators.huber import HUBER, huber
from ident.estimators.robust import MEstimator, RobustFit

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


@pytest.mark.parametrize(
    ("estimator", "norm"),
    [
        pytest.param(HUBER, sm.robust.norms.HuberT(t=1.345), id="huber"),
        pytest.param(BIWEIGHT, sm.robust.norms.TukeyBiweight(c=4.685), id="biweight"),
    ],
)
def test_one_joint_is_statsmodels_rlm(estimator: MEstimator, norm: sm.robust.norms.RobustNorm) -> None:
    stacked = spoiled()
    fit = estimator.fit(stacked, NAMES)
    model = sm.RLM(stacked.y, stacked.x, M=norm)
    reference = model.fit(conv="coefs", tol=1e-10, maxiter=500)
    assert fit.converged
    assert fit.beta == pytest.approx(reference.params, rel=1e-7)
    assert fit.sigma[0] == pytest.approx(reference.scale, rel=1e-6)
    assert fit.weights == pytest.approx(reference.weights, abs=1e-6)
    assert fit.covariance == pytest.approx(reference.bcov_scaled, rel=1e-6)


def test_contacts_bias_least_squares_and_not_hubers() -> None:
    stacked = spoiled(joints=2)
    robust, plain = HUBER.fit(stacked, NAMES), weighted_least_squares(stacked, NAMES)
    redescending = BIWEIGHT.fit(stacked, NAMES)
    assert np.max(np.abs(robust.beta - TRUTH)) < 0.03
    # What lies far off does not pull at all, so less bias is left.
    assert np.linalg.norm(redescending.beta - TRUTH) < 0.5 * np.linalg.norm(robust.beta - TRUTH)
    assert np.max(np.abs(plain.beta - TRUTH)) > 0.1
    assert robust.sigma == pytest.approx([0.2, 3.0], rel=0.2)


def test_spikes_are_what_weighs_less() -> None:
    fit = HUBER.fit(spoiled(joints=2), NAMES)
    assert isinstance(fit, RobustFit)
    # Five per cent spoiled, and 17 % of normal errors lie beyond 1.345 σ.
    assert 0.15 < np.mean(fit.weights < 1.0) < 0.3
    assert np.mean(fit.weights < 0.2) == pytest.approx(0.05, abs=0.02)


def test_a_high_threshold_is_weighted_least_squares() -> None:
    stacked = spoiled()
    beta = np.linalg.lstsq(stacked.x, stacked.y, rcond=None)[0]
    assert huber(1e6).fit(stacked, NAMES).beta == pytest.approx(beta, rel=1e-10)
