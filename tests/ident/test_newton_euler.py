"""Torque of links along a motion in machine code, against Pinocchio's recursive Newton–Euler."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio
import pytest

from drivers.simulated.physics.chain import chain_of
from ident.effects.chain import chain_frames
from ident.parameters.newton_euler import BLOCK, torque_along
from robots.arrays import FloatArray

JOINTS = (
    pinocchio.JointModelRZ(),
    pinocchio.JointModelRevoluteUnaligned(np.array([0.48, -0.6, 0.64])),
    pinocchio.JointModelPX(),
    pinocchio.JointModelPrismaticUnaligned(np.array([0.0, 0.8, 0.6])),
)
"""Turning and sliding, along an axis of the frame and along any."""


def chain(generator: np.random.Generator, joints: list[pinocchio.JointModel]) -> pinocchio.Model:
    """A chain of bodies of any inertia, placed anyhow."""
    model = pinocchio.Model()
    for number, joint in enumerate(joints):
        turn = pinocchio.exp3(generator.normal(size=3))
        placement = pinocchio.SE3(turn, generator.uniform(-0.5, 0.5, size=3))
        index = model.addJoint(number, joint, placement, f"joint {number}")
        turned = pinocchio.SE3(pinocchio.exp3(generator.normal(size=3)), generator.uniform(-0.2, 0.2, 3))
        mass, inertia = generator.uniform(0.5, 5.0), np.diag(generator.uniform(0.02, 0.03, 3))
        model.appendBodyToJoint(index, pinocchio.Inertia(mass, np.zeros(3), inertia), turned)
    model.gravity.linear = generator.normal(size=3) * 9.81
    return model


def parameters(model: pinocchio.Model) -> FloatArray:
    """(n, 10), as they are identified."""
    return np.array([inertia.toDynamicParameters() for inertia in list(model.inertias)[1:]])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("samples", [1, BLOCK, 3 * BLOCK + 5])
def test_the_torque_is_that_of_pinocchio(seed: int, samples: int) -> None:
    generator = np.random.default_rng(seed)
    order = generator.permutation(len(JOINTS))
    model = chain(generator, [JOINTS[k] for k in (*order, *order[: seed % 3])])
    frames = chain_frames(model)
    assert frames is not None
    sizes = np.array([3.0, 2.0, 5.0])[:, np.newaxis, np.newaxis]
    q, v, a = generator.normal(size=(3, samples, model.nv)) * sizes
    data = model.createData()
    expected = np.array([pinocchio.rnea(model, data, q[k], v[k], a[k]) for k in range(samples)])
    torque = torque_along(frames, parameters(model), np.array(model.gravity.linear), q, v, a)
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def test_an_angle_may_be_many_turns_and_lie_on_any_quarter() -> None:
    """One link whose mass lies at a lever of 1 kg·m: gravity's torque is a cosine or a sine of the angle."""
    model = pinocchio.Model()
    model.addJoint(0, pinocchio.JointModelRZ(), pinocchio.SE3.Identity(), "joint")
    frames = chain_frames(model)
    assert frames is not None
    quarters, generator = np.arange(-40, 41) * 0.5 * np.pi, np.random.default_rng(1)
    edges = [quarters, quarters + 0.25 * np.pi, np.nextafter(quarters + 0.25 * np.pi, 0.0)]
    anywhere = [generator.uniform(-reach, reach, 400) for reach in (1e-6, 1.0, 30.0, 1e5)]
    angles = np.concatenate(edges + anywhere)[:, np.newaxis]
    for lever, expected in ((1, np.cos(angles)), (2, -np.sin(angles))):
        links, still = np.zeros((1, 10)), np.zeros_like(angles)
        links[0, lever] = 1.0
        torque = torque_along(frames, links, np.array([0.0, -1.0, 0.0]), angles, still, still)
        np.testing.assert_allclose(torque, expected, rtol=0.0, atol=3e-16)


class Asked:
    """A joint that tells whether its own values are among those that it gets."""

    def __init__(self, joint: pinocchio.JointModel, told: list[bool]) -> None:
        self.joint, self.told = joint, told

    def __getattr__(self, name: str) -> object:
        return getattr(self.joint, name)

    def calc(self, data: object, position: FloatArray, velocity: FloatArray) -> None:
        self.told.append(position.size > self.joint.idx_q and velocity.size > self.joint.idx_v)
        self.joint.calc(data, position, velocity)


@pytest.mark.parametrize("frames_of", [chain_frames, lambda model: chain_of(model, np.zeros(3))])
def test_a_joint_is_asked_with_the_values_of_all(frames_of: Callable[[Any], object]) -> None:
    """With its own alone it reads behind them in memory: long campaigns ended without a word."""
    model, told = chain(np.random.default_rng(0), list(JOINTS)), list[bool]()
    seen = SimpleNamespace(
        **{name: getattr(model, name) for name in ("njoints", "nq", "nv", "parents", "jointPlacements")},
        joints=[Asked(joint, told) for joint in model.joints],
        inertias=model.inertias,
    )
    assert frames_of(seen) is not None
    assert told == [True] * len(JOINTS)
