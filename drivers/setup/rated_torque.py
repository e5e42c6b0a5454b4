"""Torque as the drive counts it, beside the description: its limit, and what one count of it is worth.

Torques of CiA 402-2 are in per mille of the motor's rated torque (6076), which is in mN·m.
"""

from __future__ import annotations

from math import pi

import numpy as np

from drivers.setup.findings import Finding
from drivers.setup.told_units import Settings
from robots.description import Robot

RELATIVE = (0x6074, 0x6077, 0x6078)
"""Control signals in per mille of a rated value: torque demand and actual value, and the actual current."""
UNITS = {"mN·m": 1e-3, "µN·m": 1e-6}
"""Of 6076: as CiA 402-2 has it, and as some makers do."""
GEAR_EFFICIENCY = 0.5
"""Least that gears of arms pass on when they drive."""
TORQUE_CONSTANT = 0.2
"""Share by which a motor's torque for a current may differ from its name plate: spread, hot magnets."""
GAIN_RATIO = ((1.0 - TORQUE_CONSTANT) * GEAR_EFFICIENCY, 1.0 + TORQUE_CONSTANT)
"""Of the described torque at the drive output to the motor's times the gear."""
WIDE = 2.0
"""A drive that allows so many times what the description does protects nothing."""


def compare_torque(robot: Robot, axis: int, settings: Settings) -> list[Finding]:
    """What the drive of an axis says of its torque limit and of the torque that one count is.

    Args:
        robot: the description.
        axis: from 0.
        settings: read from the drive.
    """
    share, rated = settings.get("6072"), settings.get("6076")
    if not rated:
        return [Finding("info", "6076", "rated torque unknown: neither 6072 nor gain is compared")]
    found = [] if share is None else _limit(robot, axis, 1e-6 * share * rated)
    if (doubt := doubtful_gain(robot, axis, settings)) is not None:
        found.append(Finding("warning", "6076", doubt))
    return found


def doubtful_gain(robot: Robot, axis: int, settings: Settings) -> str | None:
    """How the described gain contradicts the drive's rated torque; None where it does not or nothing is told.

    A gear passes on less than the motor gives and never more, so the described torque of one count is at most
    the motor's times the gear, and at least the share that a poor gear and a hot motor leave of it. A joint
    that is pushed along a line is left out: its drive may mean a torque or a force.
    """
    drive, rated = robot.drive[axis], settings.get("6076")
    if not rated or drive.control_signal.index not in RELATIVE or robot.joint[axis].kind != "revolute":
        return None
    described = drive.gain * drive.control_signal.per_count
    low, high = GAIN_RATIO
    ratios = {unit: described / (1e-3 * rated * size * drive.gear) for unit, size in UNITS.items()}
    if any(low <= ratio <= high for ratio in ratios.values()):
        return None
    unit, ratio = min(ratios.items(), key=lambda pair: abs(np.log(pair[1])))
    return (
        f"1000 counts of {drive.control_signal.index:04X} are {1e3 * described:.3g} N·m at the drive output"
        f" as described (gain × per_count), {ratio:.2g} times the {rated} {unit} of the drive's motor (6076)"
        f" behind a gear of {drive.gear:g}; {low:.2g} to {high:.2g} can be: gain, per_count, gear or 6076"
    )


def _limit(robot: Robot, axis: int, torque: float) -> list[Finding]:
    torque *= torque_ratio(robot, axis)
    allowed = float((np.abs(np.linalg.inv(robot.transmission_matrix).T) @ robot.torque_limits)[axis])
    if torque <= WIDE * allowed:
        return []
    text = f"the drive may give {torque:.4g} at the output, the torque limits ask for {allowed:.4g}"
    return [Finding("warning", "6072", text)]


def torque_ratio(robot: Robot, axis: int) -> float:
    """Torque (or force) at the drive output for each N·m of the motor, without losses."""
    per_output = 2 * pi if robot.joint[axis].kind == "prismatic" else 1.0
    return per_output * robot.drive[axis].gear
