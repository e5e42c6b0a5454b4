"""Effects that are made of speed terms have the columns that their formula says."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident.effects import (
    AsymmetricFriction,
    CoulombFriction,
    CurrentOffset,
    Effect,
    FrictionSign,
    RotorInertia,
    State,
    ViscousFriction,
    WristCoupling,
)
from ident.effects.torque_of import HasTorque, torque_of
from ident.parameters.base import random_states
from robots.arrays import FloatArray

TX40 = robots.load("tx40")
SIGNS = [FrictionSign("sign", 0.0), FrictionSign("tanh", 0.02)]


def states() -> State:
    """Random states, and one at rest."""
    random = random_states(TX40, seed=4, states=20)
    random.velocity[0] = 0.0
    return random


def diagonal(values: FloatArray) -> FloatArray:
    return values[:, :, np.newaxis] * np.eye(values.shape[1])


@pytest.mark.parametrize("sign", SIGNS)
def test_coulomb_friction(sign: FrictionSign) -> None:
    state = states()
    found = CoulombFriction(TX40, sign).columns(state)
    np.testing.assert_array_equal(found, diagonal(sign(state.velocity)))


@pytest.mark.parametrize("sign", SIGNS)
def test_asymmetric_friction(sign: FrictionSign) -> None:
    state = states()
    v = state.velocity
    expected = [diagonal((d * v > 0) * values) for d in (1, -1) for values in (v, sign(v))]
    found = AsymmetricFriction(TX40, sign).columns(state)
    np.testing.assert_array_equal(found, np.concatenate(expected, axis=2))


@pytest.mark.parametrize("sign", SIGNS)
def test_wrist_coupling(sign: FrictionSign) -> None:
    """Drive 6 turns with q5 + q6: inertia and viscous friction couple the two, dry friction acts on both."""
    state = states()
    columns = WristCoupling(TX40, sign).columns(state)
    assert columns.shape == (20, 6, 3)
    dry = sign(state.velocity[:, 4] + state.velocity[:, 5])
    expected = np.zeros_like(columns)
    expected[:, 4] = np.column_stack([state.acceleration[:, 5], state.velocity[:, 5], dry])
    expected[:, 5] = np.column_stack([state.acceleration[:, 4], state.velocity[:, 4], dry])
    np.testing.assert_allclose(columns, expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("sign", SIGNS)
def test_torques_are_those_of_the_columns(sign: FrictionSign) -> None:
    """What is made without columns is the same torque; offsets of some joints alone among it."""
    state = states()
    settings = TX40.identification.model_copy(update={"offset": (True, False, True, True, False, True)})
    some = TX40.model_copy(update={"identification": settings})
    effects: tuple[Effect, ...] = (
        RotorInertia(TX40),
        ViscousFriction(TX40),
        CoulombFriction(TX40, sign),
        CurrentOffset(TX40),
        CurrentOffset(some),
        WristCoupling(TX40, sign),
    )
    assert all(isinstance(effect, HasTorque) for effect in effects)
    for effect in (*effects, AsymmetricFriction(TX40, sign)):
        values = np.random.default_rng(1).normal(size=len(effect.parameters))
        expected = effect.columns(state) @ values
        np.testing.assert_allclose(torque_of(effect, state, values), expected, rtol=1e-13, atol=1e-13)
