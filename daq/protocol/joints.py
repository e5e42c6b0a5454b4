"""The joints of a commissioning protocol: drive, limits, and how far the fastest stage's recording went."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.catalogue.values import Arm
from daq.recording.capture import Capture
from daq.text.numbers import NOTHING, percent, setting, significant
from robots import Robot
from robots.arrays import FloatArray


@dataclass(frozen=True)
class JointRow:
    """One joint: its drive, its limits, and how far the recording of ``Protocol.figures_of`` went."""

    name: str
    node: int
    serial: str
    position: str
    velocity: str
    acceleration: str
    torque: str
    fastest: str
    strongest: str
    following: str


def joint_rows(robot: Robot, arm: Arm, capture: Capture | None) -> tuple[JointRow, ...]:
    peaks = None if capture is None else _peaks(robot, capture)
    rows = []
    for k, (joint, drive) in enumerate(zip(robot.joint, robot.drive, strict=True)):
        reached = (NOTHING,) * 3
        if peaks is not None:
            speed, torque, error = (float(peak[k]) for peak in peaks)
            reached = (
                f"{significant(speed)} ({percent(100 * speed / joint.velocity)})",
                f"{significant(torque)} ({percent(100 * torque / joint.torque)})",
                f"{significant(error)} {joint.unit}",
            )
        low, high = joint.position
        serial = arm.serials[k] if k < len(arm.serials) else None
        rows.append(
            JointRow(
                joint.name,
                drive.node_id,
                "none" if serial is None else str(serial),
                f"{setting(low)} … {setting(high)} {joint.unit}",
                f"{setting(joint.velocity)} {joint.unit}/s",
                f"{setting(joint.acceleration)} {joint.unit}/s²",
                f"{setting(joint.torque)} {joint.torque_unit}",
                *reached,
            )
        )
    return tuple(rows)


def _peaks(robot: Robot, capture: Capture) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(n,) each: highest speed, torque by the drive gains, following error; all by amount."""
    samples = capture.samples
    time = samples.cycle * capture.period
    speed = np.gradient(samples.position, time, axis=0)
    torque = robot.joint_torque(samples.control_signal)
    error = samples.reference - samples.position
    fastest, strongest, farthest = (np.nanmax(np.abs(x), axis=0) for x in (speed, torque, error))
    return np.asarray(fastest), np.asarray(strongest), np.asarray(farthest)
