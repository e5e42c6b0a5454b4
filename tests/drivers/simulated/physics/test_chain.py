"""The compiled rigid bodies against pin, on the shipped arms and on chains that nobody built."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import robots
from drivers.simulated.physics.chain import chain_of
from drivers.simulated.physics.entry_points import compiled
from drivers.simulated.physics.records import resting
from drivers.simulated.plant import Plant
from drivers.simulated.truth import draw_truth


def random_chain(seed: int) -> pin.Model:
    """Joints about or along arbitrary axes, placed arbitrarily, with arbitrary bodies."""
    rng = np.random.default_rng(seed)
    model = pin.Model()
    for j in range(int(rng.integers(1, 8))):
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        kind = pin.JointModelRevoluteUnaligned if rng.random() < 0.7 else pin.JointModelPrismaticUnaligned
        model.addJoint(j, kind(*axis), pin.SE3.Random(), f"joint_{j}")
        model.appendBodyToJoint(j + 1, pin.Inertia.Random(), pin.SE3.Identity())
    model.gravity.linear = rng.standard_normal(3) * 9.81
    return model


@pytest.mark.parametrize("seed", range(12))
def test_the_mass_matrix_is_pins_on_any_serial_chain(seed: int) -> None:
    pin.seed(seed)
    model = random_chain(seed)
    chain = chain_of(model, model.gravity.linear)
    rng = np.random.default_rng(seed + 100)
    for _ in range(5):
        q = rng.uniform(-3, 3, model.nq)
        found = np.zeros((model.nv, model.nv))
        compiled.links(chain, q, found)
        assert found == pytest.approx(pin.crba(model, model.createData(), q), abs=1e-10)


@pytest.mark.parametrize("name", ["tx40", "emps"])
def test_mass_and_bias_are_pins_on_the_shipped_arms(name: str) -> None:
    robot = robots.load(name)
    truth = draw_truth(robot, 3)
    plant = Plant(robot, truth)
    rng = np.random.default_rng(1)
    data = plant.model.createData()
    for _ in range(20):
        plant.position[:] = rng.uniform(robot.lower, robot.upper)
        plant.velocity[:] = rng.uniform(-1, 1, robot.n) * robot.velocity_limits
        compiled.posture(plant.arm, plant.motion)
        bias = pin.nonLinearEffects(plant.model, data, plant.position, plant.velocity)
        assert plant.motion.loads == pytest.approx(bias + truth.per_drive("off"), abs=1e-9)
        assert plant.motion.mass == pytest.approx(pin.crba(plant.model, data, plant.position), abs=1e-10)


def test_a_state_at_rest_has_nothing_moving() -> None:
    motion = resting(np.array([1.0, 2.0]), 3)
    assert motion.position.tolist() == [1.0, 2.0]
    assert not motion.velocity.any()
    assert len(motion.motors) == 3
    assert motion.braked.all()
