"""Hysteresis of a dress pack: hoses and cables along the joint that pull back, and come back by another way.

The strands of a bundle slide on each other when it is bent: its stiffness falls from that of the whole to
that of the single strands, and the way back is another one (Papailiou, On the bending stiffness of
transmission line conductors, IEEE Trans. Power Delivery 12, 1997). To first order a spring beside a bristle
(Dahl 1968) that is as long as the pack bends, which is far more than any gear winds up.
"""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.hysteresis import deflection
from ident.effects.placed import (
    ANY,
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    angle_unit,
    each_joint,
    joint_row,
    torque_unit,
)
from ident.effects.scales import rated_torque, way
from ident.effects.simulated import Bristle, FrictionTorque, PositionTorque, SimulatedParts, Table
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

_PACK = 0.03
"""Of the rated torque, deviation of what a pack pulls with: as of a cable."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, joint, (length,) = joint_row(robot, place), place.joints[0], shape

    def law(state: State) -> FloatArray:
        position = state.position[:, joint]
        bent = np.zeros_like(position) if state.time is None else deflection(position, length)
        return along(row, bent, position, np.ones_like(position))

    def parts(values: FloatArray) -> SimulatedParts:
        # A straight line, which goes on beyond the table.
        ends = np.linspace(float(robot.lower[joint]), float(robot.upper[joint]), 5)
        line = Table.at(float(ends[0]), float(ends[1] - ends[0]), values[1] * ends + values[2])
        return SimulatedParts(
            position=(PositionTorque(row, row, line),),
            friction=(FrictionTorque(row, values[0] * row, Bristle(length, "exponential")),),
        )

    torque, size = torque_unit(robot, place), _PACK * rated_torque(robot, place)
    scale = (size, size / way(robot, place), size)
    symbols = ("pack_hysteresis", "pack_stiffness", "pack_pull")
    units = (torque, f"{torque}/{angle_unit(robot, place)}", torque)
    return Parameters(symbols, units, (POSITIVE, POSITIVE, ANY), scale), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    low, *grid, high = (share * way(robot, place) for share in (0.02, 0.1, 0.3, 1.0, 5.0))
    return (Shape("bend", angle_unit(robot, place), tuple(grid), low, high, True),)


DRESS_PACK_HYSTERESIS = Family(
    "dress_pack_hysteresis",
    "a dress pack that pulls back and comes back by another way",
    "joint",
    each_joint,
    _make,
    _shapes,
    essential=(0, 1),
    contains=("hysteresis", "gravity_spring", "current_offset"),
    confused_with=("hysteresis", "cable_spring", "gravity_spring"),
    shows="both",
    history=True,
    settled_by="take the dress pack off and record again: what it pulled with and lost is gone",
    told_from={
        "hysteresis": "take the dress pack off and record again: a pack's hysteresis is gone, a gear's stays",
    },
    equation=(
        "pack_hysteresis·z + pack_stiffness·q + pack_pull with the bristle dz/dq = (1 − z·sign(q̇))/bend over"
        " the joint, as of `hysteresis` over the drive"
    ),
    row=265,
)
