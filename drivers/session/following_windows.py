"""The drives' own following error windows (6065h) beside what a motion demands of their loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivers.errors import DriveError
from drivers.frames.job import HomingJob, Job
from drivers.setup.drive import DriveReport
from drivers.setup.homing import Homing
from robots.arrays import FloatArray
from robots.description import Robot
from robots.windows import demanded_following_error

SMALLEST_WINDOW, LARGEST_WINDOW = np.deg2rad(0.2), np.deg2rad(1.0)
"""rad (or m): friction keeps a loop away from its target by tenths of a degree for a while."""
_OFF = 0xFFFF_FFFF
_REPORTING_CYCLES = 3
"""SYNC periods from a target to the reading that shows it: interpolation takes up to two, the report one."""


def arrival_windows(targets: FloatArray) -> FloatArray:
    """How far each joint may stay behind in a slow motion, and end from where it was sent, (n,) rad or m.

    A tenth of its way, to 1°.

    Args:
        targets: N × n joint positions, rad or m.
    """
    return np.asarray(np.clip(0.1 * np.ptp(targets, axis=0), SMALLEST_WINDOW, LARGEST_WINDOW))


def check_following_windows(robot: Robot, speed: FloatArray, reports: Sequence[DriveReport]) -> None:
    """Refuse a motion that a drive would end by itself, because its window is too tight for it.

    Args:
        robot: the description.
        speed: (n,) largest of the drive outputs, rad/s or m/s.
        reports: what the drives' windows are.

    Raises:
        DriveError: drive, window and what the motion demands.
    """
    demanded = demanded_following_error(robot, speed) * np.abs(robot.counts_per_output_unit)
    for axis, report in enumerate(reports):
        window = report.settings.get("6065")
        if window is None or window == _OFF or demanded[axis] <= window:
            continue
        raise DriveError(
            f"drive {axis + 1} ({robot.joint[axis].name}): 6065 is {window} counts, "
            f"this motion demands {np.ceil(demanded[axis]):.0f} of the loop as described; widen 6065 in the "
            "drive, or move slower"
        )


def standing_error(robot: Robot) -> FloatArray:
    """How far loops without integral action may stand off their targets, (n,) rad or m at the drive outputs.

    The torque limit over the loop's stiffness, g_τ · position_gain (· velocity_gain of a cascade); a loop
    with integral action comes to its target.
    """
    controller = robot.controller
    stiffness = robot.gains * np.array(controller.position_gain)
    if controller.type == "cascade_p_pi":
        stiffness = stiffness * np.array(controller.velocity_gain)
    torque = np.abs(np.linalg.inv(robot.transmission_matrix).T) @ robot.torque_limits
    return np.where(np.array(controller.integral_gain) > 0, 0.0, torque / stiffness)


def narrowed(job: Job, robot: Robot, targets: FloatArray) -> Job:
    """A job of a slow motion: a following error that its speed explains, and a window to arrive in.

    Args:
        job: as for any motion.
        robot: the description.
        targets: N × n joint positions, rad or m.
    """
    standing, across = standing_error(robot), robot.transmission_matrix
    window = arrival_windows(targets) + np.abs(np.linalg.inv(across)) @ standing
    speed = output_speed(robot, targets)
    # Until the master reads what it has sent, the outputs move on.
    lag = _REPORTING_CYCLES * robot.bus.cycle_time * speed
    explained = demanded_following_error(robot, speed) + lag
    counts = np.ceil((explained + np.abs(across) @ window) * np.abs(robot.counts_per_output_unit)).astype(
        np.int64
    )
    following_error = np.minimum(job.following_error, np.maximum(counts, 2))
    return replace(job, following_error=following_error, arrival=window)


def homing_job(robot: Robot, homing: Homing) -> HomingJob:
    """The bounds of a search: its way, its time, its speed, and what the drive has to read at its home.

    It may stand from there by the way that it takes to brake (v² / 2a), and by the smallest window.

    Raises:
        DriveError: a value is not allowed.
    """
    axis = homing.axis(robot)
    speed, acceleration = homing.pace(robot)
    size = abs(float(robot.counts_per_output_unit[axis]))
    return HomingJob(
        axis,
        travel=round(homing.travel * size),
        seconds=homing.seconds,
        speed=speed * size,
        home=homing.offset(robot),
        near=round((SMALLEST_WINDOW + speed**2 / (2 * acceleration)) * size) + 1,
    )


def homing_speed(robot: Robot, homing: Homing) -> FloatArray:
    """Speeds of the drive outputs in a search, (n,) rad/s or m/s."""
    speed = np.zeros(robot.n)
    speed[homing.axis(robot)] = homing.pace(robot)[0]
    return speed


def output_speed(robot: Robot, targets: FloatArray) -> FloatArray:
    """Largest speed of each drive output in a motion, (n,)."""
    if len(targets) < 2:
        return np.zeros(robot.n)
    outputs = targets @ robot.transmission_matrix.T
    return np.asarray(np.abs(np.diff(outputs, axis=0)).max(axis=0) / robot.bus.cycle_time)
