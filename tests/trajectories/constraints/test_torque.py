"""Torque bounds along a motion: above every sample of an independent inverse dynamics, and not far above."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from robots import load, rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.constraints.torque import TorqueCheck
from trajectories.limits import Limits
from trajectories.motions.motion import MotionState
from trajectories.motions.segments import PiecewiseJerk, SegmentPlanner, Waypoint, join


def random_motion(limits: Limits, seed: int) -> PiecewiseJerk:
    generator = np.random.default_rng(seed)
    planner = SegmentPlanner(limits)
    waypoint = Waypoint.at_rest(np.zeros(limits.n))
    parts: list[PiecewiseJerk] = []
    while len(parts) < 3:
        goal = Waypoint(
            0.7 * generator.uniform(limits.lower, limits.upper),
            0.5 * generator.uniform(-1, 1, limits.n) * limits.velocity,
            np.zeros(limits.n),
        )
        part = planner.connect(waypoint, goal)
        if part is not None:
            parts.append(part)
            waypoint = goal
    return join(parts)


def drive_torque(robot: Robot, state: MotionState) -> FloatArray:
    """Per sample: RNEA through the transmission, plus each drive's own inertia and friction."""
    model = rigid_body_model(robot)
    data = model.createData()
    torque = []
    for q, v, a in zip(state.position, state.velocity, state.acceleration, strict=True):
        links = pinocchio.rnea(model, data, q, v, a)
        at_drives = np.linalg.solve(robot.transmission_matrix.T, links)
        for k, drive in enumerate(robot.drive):
            speed, acceleration = robot.transmission_matrix[k] @ v, robot.transmission_matrix[k] @ a
            at_drives[k] += drive.dynamics.inertia * acceleration + drive.dynamics.viscous * speed
            at_drives[k] += drive.dynamics.coulomb * np.sign(speed)
        torque.append(at_drives)
    return np.array(torque)


@pytest.mark.parametrize("name", ["tx40", "emps"])
@pytest.mark.parametrize("seed", [0, 1])
def test_bounds_hold_between_samples_and_are_tight(name: str, seed: int) -> None:
    robot = load(name)
    limits = Limits.of(robot)
    motion = random_motion(limits, seed)
    joint, drive = TorqueCheck.of(robot, limits).use(motion)
    dense = motion.at(np.linspace(0.0, motion.duration, 30_000))
    at_drives = drive_torque(robot, dense)
    for use, torque in ((drive, at_drives), (joint, at_drives @ robot.transmission_matrix)):
        largest = np.abs(torque).max(axis=0)
        assert (largest <= use.value * (1 + 1e-4)).all()
        assert (use.value <= largest * 1.1 + 2 * max(d.dynamics.coulomb for d in robot.drive)).all()
        np.testing.assert_allclose(use.share, use.value / use.limit)


def test_the_coarse_check_of_the_search_agrees_with_the_fine_one() -> None:
    robot = load("tx40")
    limits = Limits.of(robot)
    motion = random_motion(limits, 4)
    worst = max(use.share.max() for use in TorqueCheck.of(robot, limits).use(motion))
    assert TorqueCheck.of(robot, limits.with_torque_share(worst * 1.1)).within(motion)
    assert not TorqueCheck.of(robot, limits.with_torque_share(worst * 0.9)).within(motion)
