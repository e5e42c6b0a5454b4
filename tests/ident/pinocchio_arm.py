"""Recordings of an arm whose torques pin computes: no regressor, no filter and no effect of ours."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pinocchio

import robots
from ident import Recording
from robots import Robot
from robots.arrays import FloatArray

STEP = 0.002
"""s."""

Hook = Callable[[pinocchio.Model, pinocchio.Data, FloatArray, FloatArray, FloatArray], FloatArray]
"""Torque (n,) that something else adds, at q, q̇, q̈."""


@cache
def tx40() -> Robot:
    robot = robots.load("tx40")
    settings = robot.identification.model_copy(
        update={"cutoff_hz": 20.0, "decimation": 10, "control_signal_lag": 0.0, "covariance": "hac"}
    )
    return robot.model_copy(update={"identification": settings})


def course(
    robot: Robot, seed: int, seconds: float = 12.0, share: float = 0.6
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """q, q̇, q̈ of sums of sines about home within a share of the range, samples × joints, exact."""
    generator = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, STEP)
    q, v, a = (np.empty((t.size, robot.n)) for _ in range(3))
    for joint, home in enumerate(robot.home):
        frequency = 2 * np.pi * np.array([0.13, 0.31, 0.57, 0.9]) * (1 + 0.07 * joint)
        size, phase = generator.uniform(0.4, 1.0, 4) / frequency, generator.uniform(0, 2 * np.pi, 4)
        reach = share * min(home - robot.lower[joint], robot.upper[joint] - home)
        size *= min(reach / size.sum(), 0.6 * robot.velocity_limits[joint] / (size * frequency).sum())
        angle = np.outer(t, frequency) + phase
        q[:, joint] = home + np.sin(angle) @ size
        v[:, joint] = np.cos(angle) @ (size * frequency)
        a[:, joint] = -np.sin(angle) @ (size * frequency**2)
    return q, v, a


def links_of(robot: Robot) -> pinocchio.Model:
    model = pinocchio.buildModelFromUrdf(str(robot.urdf_path))
    model.gravity.linear = np.array(robot.gravity)
    return model


def record(
    seed: int,
    *,
    body: pinocchio.Inertia | None = None,
    hook: Hook | None = None,
    noise: float = 0.3,
    encoder: float = 1e-5,
    seconds: float = 12.0,
    share: float = 0.6,
) -> Recording:
    """A recording, with a body in the frame of the last joint and whatever a hook adds to the torque."""
    robot = tx40()
    q, v, a = course(robot, seed, seconds, share)
    model = links_of(robot)
    if body is not None:
        model.appendBodyToJoint(robot.n, body, pinocchio.SE3.Identity())
    data = model.createData()
    torque = np.array([pinocchio.rnea(model, data, *state) for state in zip(q, v, a, strict=True)])
    drives = [drive.dynamics for drive in robot.drive]
    inertia, viscous, coulomb = (
        np.array([getattr(one, name) for one in drives]) for name in ("inertia", "viscous", "coulomb")
    )
    turn = robot.transmission_matrix
    u, w = v @ turn.T, a @ turn.T
    torque += (w * inertia + u * viscous + np.sign(u) * coulomb) @ turn
    if hook is not None:
        torque += np.array([hook(model, data, *state) for state in zip(q, v, a, strict=True)])
    generator = np.random.default_rng(1000 + seed)
    shaken = q + encoder * generator.standard_normal(q.shape)
    signal = robot.control_signal(torque + noise * generator.standard_normal(q.shape))
    return Recording(f"seed {seed}", STEP * np.arange(len(q)), None, shaken, signal)
