"""The drives' own following error windows (6065h) beside what a motion demands of their loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivers.errors import DriveError
from drivers.frames.job import Job
from drivers.setup.drive import DriveReport
from robots.arrays import FloatArray
from robots.description import Robot

_OFF = 0xFFFF_FFFF
_REPORTING_CYCLES = 3
"""SYNC periods from a target to the reading that shows it: interpolation takes up to two, the report one."""


def demanded_following_error(robot: Robot, targets: FloatArray) -> FloatArray:
    """The error with which the described loops follow, at the fastest instant of a motion.

    e = (1 − feed_forward) · |q̇| / position_gain of a cascade; times velocity_gain of a PD or PID loop.

    Args:
        robot: with controller and cycle time.
        targets: N × n joint positions, rad or m.

    Returns:
        (n,) rad or m at the drive outputs.
    """
    controller = robot.controller
    share = np.maximum(0.0, 1.0 - np.array(controller.velocity_feed_forward))
    error = share * _output_speed(robot, targets) / np.array(controller.position_gain)
    if controller.type != "cascade_p_pi":
        error = error * np.array(controller.velocity_gain)
    return np.asarray(error)


def reporting_lag(robot: Robot, targets: FloatArray) -> FloatArray:
    """How far the outputs move, (n,), until the master reads what it has sent."""
    return np.asarray(_REPORTING_CYCLES * robot.bus.cycle_time * _output_speed(robot, targets))


def check_following_windows(robot: Robot, targets: FloatArray, reports: Sequence[DriveReport]) -> None:
    """Refuse a motion that a drive would end by itself, because its window is too tight for it.

    Args:
        robot: the description.
        targets: N × n joint positions, rad or m.
        reports: what the drives' windows are.

    Raises:
        DriveError: drive, window and what the motion demands.
    """
    demanded = demanded_following_error(robot, targets) * np.abs(robot.counts_per_output_unit)
    for axis, report in enumerate(reports):
        window = report.settings.get("6065")
        if window is None or window == _OFF or demanded[axis] <= window:
            continue
        raise DriveError(
            f"drive {axis + 1} ({robot.joint[axis].name}): 6065 is {window} counts, "
            f"this motion demands {np.ceil(demanded[axis]):.0f} of the loop as described; widen 6065 in the "
            "drive, or move slower"
        )


def narrowed(job: Job, robot: Robot, targets: FloatArray, window: float) -> Job:
    """A job of a slow motion: a following error that its speed explains, and a window to arrive in.

    Args:
        job: as for any motion.
        robot: the description.
        targets: N × n joint positions, rad or m.
        window: rad or m, of each joint.
    """
    at_outputs = np.abs(robot.transmission_matrix).sum(axis=1) * window
    explained = demanded_following_error(robot, targets) + reporting_lag(robot, targets)
    counts = np.ceil((explained + at_outputs) * np.abs(robot.counts_per_output_unit)).astype(np.int64)
    following_error = np.minimum(job.following_error, np.maximum(counts, 2))
    return replace(job, following_error=following_error, arrival=np.full(robot.n, window))


def _output_speed(robot: Robot, targets: FloatArray) -> FloatArray:
    """Largest speed of each drive output in a motion, (n,)."""
    if len(targets) < 2:
        return np.zeros(robot.n)
    outputs = targets @ robot.transmission_matrix.T
    return np.asarray(np.abs(np.diff(outputs, axis=0)).max(axis=0) / robot.bus.cycle_time)
