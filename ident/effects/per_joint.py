"""What effects with one parameter on each joint have in common."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray
from robots.description import Robot


def diagonal_columns(values: FloatArray) -> FloatArray:
    """samples × joints → samples × joints × joints, with joint j's value on joint j's column."""
    columns = np.zeros((*values.shape, values.shape[1]))
    joints = np.arange(values.shape[1])
    columns[:, joints, joints] = values
    return columns


def joint_units(robot: Robot, revolute: str, prismatic: str) -> tuple[str, ...]:
    """The unit of a parameter of each joint, by the joint's kind."""
    return tuple(revolute if joint.kind == "revolute" else prismatic for joint in robot.joint)
