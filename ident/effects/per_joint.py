"""What effects with one parameter on each joint have in common."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, StandardParameter
from robots import unit_of
from robots.arrays import FloatArray
from robots.description import Robot


def diagonal_columns(values: FloatArray) -> FloatArray:
    """samples × joints → samples × joints × joints, with joint j's value on joint j's column."""
    columns = np.zeros((*values.shape, values.shape[1]))
    joints = np.arange(values.shape[1])
    columns[:, joints, joints] = values
    return columns


def joint_parameters(robot: Robot, effect: str, symbol: str) -> tuple[StandardParameter, ...]:
    """A parameter of each joint, with a unit by the joint's kind.

    Args:
        robot: the arm.
        effect: that they belong to.
        symbol: of a drive's parameter, e.g. ``Fc``, or ``Fcp`` for a form of it.
    """
    return tuple(
        StandardParameter(symbol, Place("joint", (k,)), effect, unit_of(symbol, joint.kind))
        for k, joint in enumerate(robot.joint)
    )
