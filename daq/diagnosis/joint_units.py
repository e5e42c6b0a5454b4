"""Units of the joints of an arm, as tables and pictures show them."""

from __future__ import annotations

from robots.description import Robot


def torque_units(robot: Robot) -> list[str]:
    """Per joint."""
    return ["N" if joint.kind == "prismatic" else "N·m" for joint in robot.joint]


def position_units(robot: Robot) -> list[str]:
    """Per joint."""
    return ["m" if joint.kind == "prismatic" else "rad" for joint in robot.joint]
