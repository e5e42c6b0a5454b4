"""The motions of a session: from a file, slower, and the way to where one begins."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.files.trajectory_file import read_motion
from daq.session.bench import OpenArm
from daq.session.session_error import SessionError
from daq.session.streaming import slower
from drivers.session import START_TOLERANCE
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Conditions, Margins, Trajectory, approach
from trajectories.motions.trajectory import stretched

APPROACH_SPEED = 0.1
"""Of the move to where a trajectory begins."""


def read_trajectory(path: Path, robot: Robot, speed: float = 1.0) -> Trajectory:
    """The motion of a file, sampled at the arm's cycle.

    Args:
        path: of the file.
        robot: the arm.
        speed: below 1, the same path in 1/speed of the time.

    Raises:
        TrajectoryFileError: it cannot be read, or is no motion of this arm.
        TrajectoryError: the speed is not above 0, up to 1.
    """
    found = read_motion(path, robot)
    return slowed(
        Trajectory.sampled(
            found.motion,
            robot.bus.cycle_time,
            family=found.family,  # type: ignore[arg-type]
            seed=found.seed,
            score=found.score,
            repeat=found.repeat,
            speed=found.speed,
        ),
        speed,
    )


def slowed(trajectory: Trajectory, speed: float) -> Trajectory:
    """The same path in 1/speed of the time.

    Raises:
        TrajectoryError: the speed is not above 0, up to 1.
    """
    if speed == 1.0:
        return trajectory
    return Trajectory.sampled(
        stretched(trajectory.motion, speed),
        trajectory.cycle_time,
        family=trajectory.family,
        seed=trajectory.seed,
        score=trajectory.score,
        repeat=slower(trajectory.repeat, speed),
        speed=trajectory.speed * speed,
    )


def refuse_undrivable(robot: Robot, trajectory: Trajectory, path: Path) -> None:
    """Does the motion keep every limit of the arm?

    Raises:
        SessionError: names what it breaks first.
    """
    conditions = Conditions(margins=Margins(position=0.0, velocity=1.0, torque=1.0))
    start = np.asarray(trajectory.position[0])
    problems = conditions.judge(robot, start=start).judge(trajectory.motion).problems
    if problems:
        raise SessionError(f"{path}: must not be driven: {problems[0]}; `armhil plan --check` tells more")


def move_to(arm: OpenArm, goal: FloatArray) -> Trajectory | None:
    """The slow move from where the arm stands to a posture (n,); None where it stands there already."""
    actual = arm.session.actual_position()
    if (np.abs(actual - goal) <= START_TOLERANCE).all():
        return None
    robot = arm.session.robot
    return approach(robot, actual, goal, robot.bus.cycle_time, APPROACH_SPEED)
