"""What the cyclic process is told of a stream, from the arm's description."""

from __future__ import annotations

import os

import numpy as np

from drivers.frames.channel import Channel
from drivers.frames.job import Budgets, Job, following_error_window, torque_limits
from drivers.frames.layout import DriveLink
from drivers.frames.units import Units
from robots.arrays import FloatArray
from robots.description import Robot

START_TOLERANCE = 0.02
"""rad or m: how far the arm may stand from a reference's first point."""
MIN_RING_ROWS = 2048
MAX_RING_ROWS = 1 << 16


def stream_job(
    robot: Robot,
    channel: Channel,
    links: tuple[DriveLink, ...],
    targets: FloatArray,
    period_ends: tuple[int, ...],
) -> Job:
    """The job of following a reference.

    Args:
        robot: the description.
        channel: where its drives are.
        links: how each is spoken to.
        targets: N × n joint positions, rad or m.
        period_ends: rows at which periods end.
    """
    units = Units.of(robot)
    window = following_error_window(robot, robot.bus.cycle_time)
    return Job(
        channel=channel,
        bitrate=robot.bus.bitrate,
        links=links,
        cycle_time=robot.bus.cycle_time,
        units=units,
        reference=units.counts(targets),
        velocity=robot.velocity_limits,
        acceleration=robot.acceleration_limits,
        following_error=np.ceil(window * np.abs(robot.counts_per_output_unit)).astype(np.int64),
        start_tolerance=np.full(robot.n, START_TOLERANCE),
        budgets=Budgets.on(channel, robot.bus.cycle_time),
        parent=os.getpid(),
        ring_capacity=int(np.clip(2 * len(targets), MIN_RING_ROWS, MAX_RING_ROWS)),
        master_node=robot.bus.master_node_id,
        period_ends=period_ends,
        torque_limits=torque_limits(robot),
        position_limits=(robot.lower, robot.upper),
        brake_release=max(drive.brake.release for drive in robot.drive),
        brake_engage=max(drive.brake.engage for drive in robot.drive),
    )
