"""The tool's speed: bounded between samples, kept by plans and moves, and named where it cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots import load, rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from tests.trajectories.random_arms import random_arm
from trajectories import Conditions, Tool, ToolSpeed, Trajectory, TrajectoryError, approach, plan
from trajectories.limits import Limits
from trajectories.motions.motion import Motion
from trajectories.motions.segments import SegmentPlanner, Waypoint, join


def random_motion(robot: Robot, seed: int) -> Motion:
    """Two segments, the first into motion; tried more slowly where a fast waypoint cannot be left again."""
    generator = np.random.default_rng(seed)
    limits = Limits.of(robot)
    planner = SegmentPlanner(limits)
    home = Waypoint.at_rest(np.array(robot.home))
    for attempt in range(400):
        first, second = (
            Waypoint(
                0.8 * generator.uniform(limits.lower, limits.upper),
                0.6 * 0.98**attempt * generator.uniform(-1, 1, limits.n) * limits.velocity,
                np.zeros(limits.n),
            )
            for _ in range(2)
        )
        parts = [planner.connect(home, first), planner.connect(first, second)]
        if parts[0] is not None and parts[1] is not None:
            return join([parts[0], parts[1]])
    raise AssertionError("no motion of this arm was found")


def differenced(robot: Robot, tool: Tool, motion: Motion, samples: int) -> FloatArray:
    """Speeds of the tool's point from the differences of its positions, by another way than the bound's."""
    model = rigid_body_model(robot)
    data = model.createData()
    frame = model.getFrameId(tool.frame)
    points = []
    for q in motion.at(np.linspace(0.0, motion.duration, samples)).position:
        pinocchio.framesForwardKinematics(model, data, q)
        points.append(data.oMf[frame].act(np.array(tool.offset)))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.asarray(steps / (motion.duration / (samples - 1)))


@given(seed=st.integers(0, 2**32 - 1), step=st.sampled_from([0.001, 0.005, 0.02]))
@settings(max_examples=15, deadline=None)
def test_the_bound_holds_between_samples_for_random_arms(
    seed: int, step: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    robot = random_arm(tmp_path_factory.mktemp("arm"), seed)
    tool = Tool(f"link_{robot.n}", (0.1, -0.05, 0.2))
    motion = random_motion(robot, seed)
    fastest = ToolSpeed(robot, tool).fastest(motion, step)
    dense = differenced(robot, tool, motion, 4000).max()
    assert fastest.speed >= dense * (1 - 1e-6)
    if step == 0.001:
        assert fastest.speed <= 1.1 * dense + 0.05
        assert 0.0 <= fastest.time <= motion.duration


def reached(trajectory: Trajectory, robot: Robot) -> float:
    return float(differenced(robot, Tool("link_6"), trajectory.motion, 6000).max())


@pytest.mark.slow
@pytest.mark.parametrize("family", ["ruckig", "fourier"])
def test_a_plan_keeps_the_speed_of_the_tool(family: str) -> None:
    robot = load("tx40")
    trajectory = plan(
        robot,
        cycle_time=0.004,
        duration=12.0,
        seed=3,
        family=family,  # type: ignore[arg-type]
        evaluations=120,
        conditions=Conditions(tool_speed=0.4),
    )
    assert 0.2 < reached(trajectory, robot) <= 0.4
    assert trajectory.detail.tool is not None
    assert trajectory.detail.tool.speed <= 0.4 and trajectory.detail.tool.limit == 0.4
    free = plan(robot, cycle_time=0.004, duration=12.0, seed=3, evaluations=60)
    assert reached(free, robot) > 1.0


def test_a_move_is_made_slower_for_the_tool() -> None:
    robot = load("tx40")
    goal = [1.5, 0.3, 1.2, 0.0, 0.5, 0.0]
    free, limited = (
        approach(robot, robot.home, goal, 0.004, 1.0, tool_speed=limit) for limit in (None, 0.25)
    )
    assert reached(free, robot) > 0.5 and reached(limited, robot) <= 0.25
    assert limited.duration > free.duration


def test_a_motion_that_is_too_fast_names_the_joint_that_moves_the_tool() -> None:
    robot = load("tx40")
    goal = np.add(robot.home, [1.5, 0, 0, 0, 0, 0])
    motion = approach(robot, robot.home, goal, 0.004, 1.0).motion
    with pytest.raises(
        TrajectoryError,
        match=r"^joint_1: tool speed of link_6 reaches .* m/s at t = .* s; allowed: 0\.1 m",
    ) as refused:
        ToolSpeed(robot, limit=0.1).require(motion)
    assert refused.value.constraint == "tool speed"


def test_a_point_off_the_flange_is_faster_and_its_path_is_known() -> None:
    robot = load("tx40")
    motion = approach(robot, robot.home, np.add(robot.home, [1.0, 0, 0, 0, 0, 0]), 0.004).motion
    near, far = ToolSpeed(robot), ToolSpeed(robot, Tool("link_6", (0.0, 0.0, 0.3)))
    assert far.fastest(motion).speed > 1.2 * near.fastest(motion).speed
    start, end = far.path(motion.at(np.array([0.0, motion.duration])).position)
    turn = np.array([[np.cos(1), -np.sin(1), 0], [np.sin(1), np.cos(1), 0], [0, 0, 1]])
    np.testing.assert_allclose(end, turn @ start, atol=1e-9)


def test_an_axis_that_slides_is_as_fast_as_it_slides() -> None:
    robot = load("emps")
    motion = approach(robot, [-0.2], [0.2], 0.001, 1.0).motion
    speed = motion.extremes().velocity[0]
    fastest = ToolSpeed(robot).fastest(motion)
    assert fastest.speed == pytest.approx(speed, rel=1e-3) and fastest.speed >= speed


def test_random_arms_are_readable(tmp_path: Path) -> None:
    assert {random_arm(tmp_path / str(seed), seed).n for seed in range(12)} >= {2, 3, 4}
