"""A prior as rows of unit variance."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident import RegressorModel, base_parameters
from ident.discrepancy.by_evidence.accepted import RUN_TO_RUN, accepted_prior
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE
from ident.discrepancy.prior import Prior, described_prior


def test_rows_say_what_the_covariance_says() -> None:
    generator = np.random.default_rng(1)
    root = generator.normal(size=(4, 4))
    prior = Prior(generator.normal(size=4), root @ root.T, "test")
    rows, target = prior.rows()
    assert np.linalg.inv(rows.T @ rows) == pytest.approx(prior.covariance, rel=1e-9)
    assert np.linalg.solve(rows, target) == pytest.approx(prior.values)


def test_an_infinite_variance_leaves_a_parameter_free() -> None:
    prior = Prior(np.array([1.0, 2.0, 3.0]), np.diag([0.1, np.inf, 0.2]), "test")
    rows, target = prior.rows()
    assert rows.shape == (2, 3)
    assert not rows[:, 1].any()
    assert rows @ np.array([1.0, 77.0, 3.0]) == pytest.approx(target)


def test_the_description_leaves_friction_free_and_holds_the_links() -> None:
    base = base_parameters(RegressorModel.of(robots.load("tx40")))
    deviation = np.sqrt(np.diag(described_prior(base).covariance))
    for name, sigma in zip(base.names, deviation, strict=True):
        friction = name.rstrip("R0123456789") in ("Fv", "Fc", "Fvm", "Fcm")
        assert np.isinf(sigma) == friction, name


def test_an_accepted_model_is_no_surer_than_two_runs_agree() -> None:
    """To the power of the evidence, which counts the prior's square by T, two deviations make two nats."""
    values = np.array([1.0, -2.0, 30.0])
    prior = accepted_prior(values, np.zeros((3, 3)))
    away = 2.0 * RUN_TO_RUN * values[1]
    assert TEMPERATURE * 0.5 * away**2 / prior.covariance[1, 1] == pytest.approx(2.0)
    assert np.count_nonzero(prior.covariance) == 3
    rough = accepted_prior(values, np.eye(3))
    assert rough.covariance == pytest.approx(np.eye(3) + prior.covariance)
