"""Inertias that no arm has go on the way to the described ones, as far as they have to; nothing else does."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident.discrepancy.existing_arm import existing
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray

MODEL = RegressorModel.of(robots.load("tx40"))
DESCRIBED = MODEL.prior()
MOTION = np.random.default_rng(0).uniform(-1.0, 1.0, (1200, 6))


def with_rotor(change: float) -> FloatArray:
    """The described arm with so much more inertia of drive 4, kg·m², and half as much friction again."""
    values = DESCRIBED.copy()
    values[MODEL.names.index("Ia4")] += change
    values[MODEL.names.index("Fc4")] *= 1.5
    return values


def least(standard: FloatArray) -> float:
    """Smallest eigenvalue of the mass matrix along the motion, kg·m²."""
    robot = MODEL.robot
    rotors = np.array([standard[MODEL.names.index(f"Ia{j + 1}")] for j in range(6)])
    drives = robot.transmission_matrix.T @ np.diag(rotors) @ robot.transmission_matrix
    coupled = standard[MODEL.names.index("Iam6")]
    drives[4, 5] += coupled
    drives[5, 4] += coupled
    mass = Present(MODEL, standard).link_mass_matrix(MOTION) + drives
    return float(np.linalg.eigvalsh(mass).min())


def test_an_arm_that_can_exist_is_left_alone() -> None:
    values = with_rotor(0.01)
    assert existing(MODEL, values, MOTION) is values


@pytest.mark.parametrize("change", [-0.08, -0.3, -3.0])
def test_an_arm_that_cannot_exist_becomes_one_that_can(change: float) -> None:
    values = with_rotor(change)
    found = existing(MODEL, values, MOTION)
    assert (found != values).any()
    again = existing(MODEL, found, MOTION)
    assert again is found, "it is one that can exist"
    friction = MODEL.names.index("Fc4")
    assert found[friction] == values[friction]
    rotor = MODEL.names.index("Ia4")
    share = (found[rotor] - values[rotor]) / (DESCRIBED[rotor] - values[rotor])
    assert share in (0.125, 0.25, 0.5, 1.0)
    assert least(found) > 0.0


def test_it_goes_no_further_than_it_has_to() -> None:
    shares = []
    rotor = MODEL.names.index("Ia4")
    for change in (-0.08, -3.0):
        values = with_rotor(change)
        shares.append((existing(MODEL, values, MOTION)[rotor] - values[rotor]) / -change)
    assert shares[0] < shares[1]
