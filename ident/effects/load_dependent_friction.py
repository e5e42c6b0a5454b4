"""Load-dependent friction: dry friction in proportion to the torque that passes through the gear."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape, State
from ident.effects.gear_load import GearLoad
from ident.effects.placed import (
    OFFSET_AT_LINK,
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    each_drive,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign = drive_row(robot, place), friction_sign(robot)
    load = GearLoad(robot, place, present, *shape)

    def law(state: State) -> FloatArray:
        return along(row, np.abs(load.torque(state)) * sign(state.velocity @ row))

    def parts(values: FloatArray) -> SimulatedParts:
        one = FrictionTorque(row, values[0] * row, sign, load_row=load.row, load_offset=load.offset)
        return SimulatedParts(friction=(one,))

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
