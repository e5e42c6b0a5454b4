"""Load-dependent friction: dry friction in proportion to the torque that passes through the gear."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape, State
from ident.effects.placed import (
    OFFSET_AT_LINK,
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    drive_torque,
    each_drive,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, drive = drive_row(robot, place), friction_sign(robot), place.joints[0]
    (offset_at_link,) = shape

    def law(state: State) -> FloatArray:
        torque = present.link_torque(state) + offset_at_link * present.offset_torque()
        return along(row, np.abs(drive_torque(robot, torque, drive)) * sign(state.velocity @ row))

    def parts(values: FloatArray) -> SimulatedParts:
        load_row = np.asarray(np.linalg.inv(robot.transmission_matrix)[:, drive], dtype=np.float64)
        return SimulatedParts(friction=(FrictionTorque(row, values[0] * row, sign, load_row=load_row),))

    return Parameters(("mu",), ("1",), (POSITIVE,), (0.15,)), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (OFFSET_AT_LINK,)


LOAD_DEPENDENT_FRICTION = Family(
    "load_dependent_friction",
    "dry friction that grows with the torque through the gear",
    "drive",
    each_drive,
    _make,
    _shapes,
    confused_with=("coulomb_friction", "drive_gain_error"),
    settled_by="record the same motion with a known payload: friction of the load grows",
    equation="mu·|torque through the gear|·sign(q̇)",
    row=70,
)
