"""Plain moves: from rest to rest, as slow as asked, and slower still where the motors are weak."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from robots import load
from robots.description import Robot
from trajectories import TrajectoryError, approach


def weakened(robot: Robot, share: float) -> Robot:
    """The same arm with a share of its motor torques."""
    joints = tuple(j.model_copy(update={"torque": j.torque * share}) for j in robot.joint)
    return robot.model_copy(update={"joint": joints})


def test_it_goes_from_rest_to_rest() -> None:
    robot = load("tx40")
    goal = np.array([1.0, -0.5, 0.7, 2.0, -1.0, 3.0])
    move = approach(robot, robot.home, goal, 0.004)
    np.testing.assert_allclose(move.position[0], robot.home, atol=1e-9)
    np.testing.assert_allclose(move.position[-1], goal, atol=1e-9)
    assert np.abs(move.velocity[[0, -1]]).max() < 1e-9
    assert move.family == "move" and move.cycle_time == pytest.approx(0.004)


@pytest.mark.parametrize("factor", [1.0, 0.5, 0.1])
def test_the_speed_factor_scales_velocity_acceleration_and_jerk(factor: float) -> None:
    robot = load("emps")
    move = approach(robot, [-0.2], [0.2], 0.001, factor)
    extremes = move.motion.extremes()
    assert extremes.velocity[0] <= 0.9 * factor * robot.velocity_limits[0] * (1 + 1e-9)
    assert extremes.acceleration[0] <= factor**2 * robot.acceleration_limits[0] * (1 + 1e-9)
    assert extremes.jerk[0] <= factor**3 * robot.jerk_limits[0] * (1 + 1e-9)


def test_weak_motors_make_it_slower() -> None:
    robot = load("tx40")
    goal = [2.0, 0.0, 1.57, 0.0, 0.5, 0.0]
    strong = approach(robot, robot.home, goal, 0.004, 1.0)
    weak_robot = weakened(
        robot, 0.7 * max(use.share.max() for use in strong.detail.uses if "torque" in use.constraint)
    )
    weak = approach(weak_robot, robot.home, goal, 0.004, 1.0)
    assert weak.duration > 1.2 * strong.duration
    assert all((use.share <= 1.0 + 1e-6).all() for use in weak.detail.uses)


def test_motors_that_cannot_hold_the_arm_are_refused_by_name() -> None:
    robot = weakened(load("tx40"), 0.2)
    with pytest.raises(TrajectoryError, match=r"^joint_2: torque reaches .* at t = .* s; allow") as refused:
        approach(robot, robot.home, [0.0, 1.5, 0.0, 0.0, 0.0, 0.0], 0.004)
    assert refused.value.constraint == "torque"
    assert refused.value.time is not None


@pytest.mark.parametrize("where", ["start", "goal"])
def test_an_end_outside_the_limits_names_joint_and_limits(where: str) -> None:
    robot = load("tx40")
    inside, outside = list(robot.home), [0.0, 0.0, 9.0, 0.0, 0.0, 0.0]
    ends = (outside, inside) if where == "start" else (inside, outside)
    with pytest.raises(TrajectoryError, match=rf"^joint_3: {where} position is 9; allowed: -2\.4") as refused:
        approach(robot, *ends, 0.004)
    assert (refused.value.constraint, refused.value.joint) == ("position", "joint_3")


def test_nowhere_to_go_is_a_standstill() -> None:
    robot = load("emps")
    move = approach(robot, [0.1], [0.1], 0.001)
    np.testing.assert_allclose(move.position, 0.1)


@pytest.mark.parametrize(("argument", "value"), [("speed_factor", 0.0), ("cycle_time", 0.0)])
def test_a_speed_or_cycle_of_zero_is_refused(argument: str, value: float) -> None:
    arguments: dict[str, Any] = {"speed_factor": 0.3, "cycle_time": 0.001} | {argument: value}
    with pytest.raises(TrajectoryError, match="allowed: above 0"):
        approach(load("emps"), [0.0], [0.1], **arguments)


def test_a_posture_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(TrajectoryError, match="goal has 2 values; allowed: 1, one per joint"):
        approach(load("emps"), [0.0], [0.1, 0.2], 0.001)
