"""Load-dependent friction: dry friction in proportion to the torque that passes through the gear."""

from __future__ import annotations

import numpy as np

from ident.effects.effect import State
from ident.effects.family import Place, PresentModel
from ident.effects.placed import (
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    drive_torque,
    each_drive,
    number,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, drive = drive_row(robot, place), friction_sign(robot), place.joints[0]

    def law(state: State) -> FloatArray:
        load = np.abs(drive_torque(robot, present.link_torque(state), drive))
        return along(row, load * sign(state.velocity @ row))

    def parts(values: FloatArray) -> SimulatedParts:
        load_row = np.asarray(np.linalg.inv(robot.transmission_matrix)[:, drive], dtype=np.float64)
        return SimulatedParts(friction=(FrictionTorque(row, values[0] * row, sign, load_row=load_row),))

    return Parameters((f"mu{number(place)}",), ("1",), (POSITIVE,)), law, parts


LOAD_DEPENDENT_FRICTION = Family(
    "load_dependent_friction",
    "dry friction that grows with the torque through the gear",
    "drive",
    each_drive,
    _make,
    confused_with=("coulomb_friction", "drive_gain_error"),
)
