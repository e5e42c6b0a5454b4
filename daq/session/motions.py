"""The motions of a session: from a file, slower, and the way to where one begins."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.recording.trajectory_file import read_motion
from daq.session.bench import OpenArm
from daq.session.cell import Cell
from daq.session.session_error import SessionError
from daq.session.streaming import slower
from drivers.session.stream_job import START_TOLERANCE
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Trajectory, approach
from trajectories.trajectory import stretched

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


def refuse_undrivable(robot: Robot, trajectory: Trajectory, path: Path, cell: Cell | None = None) -> None:
    """Does the motion keep every limit of the arm, and clear of everything in its cell?

    Raises:
        SessionError: names what it breaks first.
    """
    start = np.asarray(trajectory.position[0])
    conditions = (cell or Cell()).conditions
    problems = conditions.judge(robot, start=start).judge(trajectory.motion).problems
    if problems:
        raise SessionError(f"{path}: must not be driven: {problems[0]}; `armhil plan --check` tells more")


def move_to(arm: OpenArm, goal: FloatArray, cell: Cell | None = None) -> Trajectory | None:
    """The slow move from where the arm stands to a posture (n,); None where it stands there already.

    Where something is in the way it goes around, with a stop on the way.

    Raises:
        TrajectoryError: there is no way that keeps clear of everything.
    """
    actual = arm.session.actual_position()
    if (np.abs(actual - goal) <= START_TOLERANCE).all():
        return None
    return slow_way(arm.session.robot, actual, goal, APPROACH_SPEED, cell)


def slow_way(
    robot: Robot, start: FloatArray, goal: FloatArray, speed: float, cell: Cell | None = None
) -> Trajectory:
    """From rest at one posture (n,) to rest at another, clear of everything in the cell.

    Raises:
        TrajectoryError: there is no such way.
    """
    conditions = (cell or Cell()).conditions
    return approach(
        robot,
        start,
        goal,
        robot.bus.cycle_time,
        speed,
        conditions.surroundings,
        conditions.tool,
        conditions.tool_speed,
    )
