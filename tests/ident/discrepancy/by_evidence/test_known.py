"""The factors that β is made of."""

from __future__ import annotations

import numpy as np
import pytest

from ident.discrepancy.by_evidence.evidence.known import beta_of
from ident.discrepancy.prior import Prior
from robots.arrays import FloatArray

SHOWN = np.array([[True, True, True, False, True], [False, True, True, True, True]])
"""Of two joints: the first parameter is of the first link, the fourth friction of the second."""


def prior(covariance: FloatArray) -> Prior:
    return Prior(np.arange(5.0), covariance, "identification")


@pytest.mark.parametrize("rank", [5, 2])
def test_they_have_the_priors_covariance_and_the_last_joint_shows_few(rank: int) -> None:
    root = np.random.default_rng(rank).normal(size=(5, rank))
    covariance = root @ root.T
    for shown in (None, SHOWN):
        beta, precision = beta_of(prior(covariance), np.ones(5), shown)
        assert beta.spread @ beta.spread.T == pytest.approx(covariance, abs=1e-12)
        assert beta.mean(np.zeros(5)) == pytest.approx(np.arange(5.0))
        assert (precision == 1.0).all()
    assert (np.abs(beta.spread[SHOWN[1]]).max(axis=0) > 0.0).sum() == 4


def test_what_the_prior_leaves_free_is_counted_from_the_first_fit() -> None:
    covariance = np.diag([1.0, 4.0, np.inf, 1.0, 9.0])
    covariance[0, 4] = covariance[4, 0] = 2.0
    beta, precision = beta_of(prior(covariance), 10.0 * np.ones(5), SHOWN)
    assert beta.values == pytest.approx([0.0, 1.0, 10.0, 3.0, 4.0])
    assert precision == pytest.approx([1.0, 1.0, 0.0, 1.0, 1.0])
    assert beta.spread[2] == pytest.approx([0.0, 0.0, 1.0, 0.0, 0.0])
    held = np.array([0, 1, 3, 4])
    root = beta.spread[np.ix_(held, held)]
    assert root @ root.T == pytest.approx(covariance[np.ix_(held, held)], abs=1e-12)
