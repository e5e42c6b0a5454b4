"""The exciting trajectory that a command plans for itself, shown as a step while it is searched for."""

from __future__ import annotations

from pathlib import Path

from daq.recording.trajectory_file import SUFFIX, write_trajectory
from daq.text.progress import Steps
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Conditions, Trajectory, plan

_NO_MOTION_YET = 1e3
"""Scores from here on are of motions that break a limit, and tell nobody anything."""


def plan_exciting(
    robot: Robot,
    steps: Steps,
    *,
    duration: float,
    seed: int,
    evaluations: int,
    periods: int = 1,
    start: FloatArray | None = None,
    conditions: Conditions | None = None,
) -> Trajectory:
    """An exciting trajectory at the arm's cycle; the arguments are those of :func:`trajectories.plan`.

    Raises:
        PlanError: no motion meets the request.
    """
    with steps.step("Plan exciting trajectory") as update:
        return plan(
            robot,
            cycle_time=robot.bus.cycle_time,
            duration=duration,
            seed=seed,
            start=start,
            conditions=conditions,
            evaluations=evaluations,
            periods=periods,
            progress=lambda share, score: update(
                share, f"score {score:.2f}" if score < _NO_MOTION_YET else ""
            ),
        )


def kept_in(folder: Path, trajectory: Trajectory, robot: Robot) -> Path:
    """The file of a trajectory that was planned for an arm.

    Raises:
        TrajectoryFileError: it cannot be written.
    """
    file = folder / f"{robot.name}{SUFFIX}"
    write_trajectory(file, trajectory, robot)
    return file
