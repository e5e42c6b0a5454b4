"""Friction that takes power from a joint passes; what would drive it is said, or not trusted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.effects.family import Place, StandardParameter
from ident.identification.friction_power import driven_by_friction
from ident.preparation.observation import Rows
from ident.results import Estimate, Parameter

SPEED = 0.1 * np.sin(np.linspace(0.0, 20.0, 200))
JOINT = Place("joint", (0,))


def _rows() -> Rows:
    columns = np.stack([np.ones(200), SPEED, np.tanh(SPEED / 0.005)], axis=1)[:, np.newaxis]
    ones = np.ones((200, 1), dtype=np.bool_)
    return Rows(np.arange(200) * 0.01, np.zeros(200, dtype=np.int64), np.zeros((200, 1)), columns, ones)


def _estimate(viscous: float, dry: float, sigma: float) -> Estimate:
    """Viscous and dry friction that are hardly told apart: their sum is known by ``sigma``."""
    values = (("off1", "off", 1.0), ("Fv1", "Fv", viscous), ("Fc1", "Fc", dry))
    parameters = tuple(
        Parameter(name, value, 1.0, "", name, StandardParameter(symbol, JOINT, "friction", ""))
        for name, symbol, value in values
    )
    apart, along = np.array([0.0, -1.0, 0.08]), np.array([0.0, 0.08, 1.0])
    covariance = 100.0 * np.outer(apart, apart) + sigma**2 * np.outer(along, along)
    error = np.array([1.0])
    return Estimate("ls", parameters, covariance, "ar", 10.0, 1.0, error, error, error, 3)


@pytest.mark.parametrize(("viscous", "dry"), [(10.0, 2.0), (-5.0, 2.0), (30.0, -2.0)])
def test_friction_that_brakes_passes(viscous: float, dry: float) -> None:
    """One of both below zero is the other's: their sum still brakes."""
    assert driven_by_friction(_estimate(viscous, dry, 0.2), _rows()) == ((), False)


@pytest.mark.parametrize(
    ("sigma", "said", "sure"), [(0.2, True, True), (0.45, True, False), (1.5, False, False)]
)
def test_friction_that_drives_is_said(sigma: float, said: bool, sure: bool) -> None:
    words, beyond = driven_by_friction(_estimate(-3.0, -2.0, sigma), _rows())
    assert (bool(words), beyond) == (said, sure)
    assert not said or words[0].startswith("friction comes out below zero (joint 1 by ")


@pytest.mark.parametrize(("viscous", "said"), [(-7.0, True), (7.0, False)])
def test_dry_friction_below_zero_is_said_where_no_speed_makes_up_for_it(viscous: float, said: bool) -> None:
    """The power alone drowns in a viscous friction that a slow motion does not show."""
    estimate = _estimate(viscous, -2.0, 0.2)
    estimate = replace(estimate, covariance=np.diag([1.0, 4900.0, 0.22]))
    words, beyond = driven_by_friction(estimate, _rows())
    assert bool(words) == said
    assert not beyond
    assert not said or "joint 1 by 4.26 σ" in words[0]
