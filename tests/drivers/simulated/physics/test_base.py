"""A base that gives way, against pin's model with two more joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from drivers.simulated import PlantTruth, Scenario
from drivers.simulated.plant import Plant
from robots import Robot

STIFFNESS, PLATE, STEP = 8e4, 0.5, 1e-4


def on_a_foot(model: pin.Model) -> pin.Model:
    """The arm behind turns about x and y, with the foot's plate."""
    foot = pin.Model()
    first = foot.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "rocks_x")
    second = foot.addJoint(first, pin.JointModelRY(), pin.SE3.Identity(), "rocks_y")
    foot.inertias[second] = pin.Inertia(1e-9, np.zeros(3), PLATE * np.eye(3))
    frame = foot.addFrame(pin.Frame("foot", second, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    whole = pin.appendModel(foot, model, frame, pin.SE3.Identity())
    whole.gravity = model.gravity
    return whole


def test_an_arm_on_a_soft_foot_moves_as_pins(tx40: Robot, frictionless: PlantTruth) -> None:
    scenario = Scenario.from_dict(
        {"format": 1, "base_compliance": {"roll": STIFFNESS, "pitch": 2.0 * STIFFNESS, "plate": PLATE}}
    )
    plant = Plant(tx40, frictionless, STEP, scenario)
    held = plant.holding_torque()
    lean = plant.motion.rocking[0].copy()
    plant.engage(np.zeros(6, dtype=np.bool_))
    whole = on_a_foot(plant.model)
    data = whole.createData()
    matrix = tx40.transmission_matrix
    rotors = matrix.T @ np.diag(plant.arm.drives["inertia"]) @ matrix
    stiffness, damping = np.array([STIFFNESS, 2.0 * STIFFNESS]), plant.arm.base.damping
    q, v = np.concatenate([lean, np.array(tx40.home)]), np.zeros(8)
    # At rest it leans by the weight on it.
    gravity = pin.computeGeneralizedGravity(whole, data, q)
    np.testing.assert_allclose(-stiffness * lean, gravity[:2], rtol=1e-6)
    np.testing.assert_allclose(matrix.T @ held, gravity[2:], rtol=1e-6, atol=1e-6)
    push = held + np.array([30.0, 40.0, 10.0, 0.0, 0.0, 0.0])
    furthest = np.zeros(2)
    q = q.copy()
    for _ in range(1500):
        plant.step(push)
        mass = pin.crba(whole, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        mass[2:, 2:] += rotors
        force = -pin.nonLinearEffects(whole, data, q, v)
        force[2:] += matrix.T @ push
        force[:2] -= stiffness * q[:2] + damping * v[:2]
        v = v + STEP * np.linalg.solve(mass, force)
        q = q + STEP * v
        furthest = np.maximum(furthest, np.abs(q[:2] - lean))
    assert (furthest > 3e-4).all()  # rad: the foot is soft
    np.testing.assert_allclose(plant.velocity, v[2:], atol=0.01 * np.abs(v[2:]).max())
    np.testing.assert_allclose(plant.motion.rocking[0], q[:2], atol=0.03 * furthest.max())


def test_one_axis_may_be_firm(tx40: Robot, frictionless: PlantTruth) -> None:
    one, both = (
        Plant(tx40, frictionless, STEP, Scenario.from_dict({"format": 1, "base_compliance": given}))
        for given in ({"pitch": STIFFNESS}, {"roll": 1e12, "pitch": STIFFNESS})
    )
    push = one.holding_torque() + np.array([30.0, 40.0, 10.0, 0.0, 0.0, 0.0])
    for plant in (one, both):
        plant.engage(np.zeros(6, dtype=np.bool_))
        for _ in range(500):
            plant.step(push)
    assert one.motion.rocking.shape == (3, 1)
    np.testing.assert_allclose(one.velocity, both.velocity, atol=1e-5)
    assert one.motion.rocking[0, 0] == pytest.approx(both.motion.rocking[0, 1], rel=1e-4)
