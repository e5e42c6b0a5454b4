"""Friction that depends on where the joint is: a worn or tight place of gear or bearing."""

from __future__ import annotations

import numpy as np

from ident.effects.effect import State
from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    each_drive,
    number,
    torque_unit,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts, Table
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_MARGIN = 0.5
"""rad (or m) beyond the limits that the simulation's table reaches."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, (waves,) = drive_row(robot, place), friction_sign(robot), shape

    def law(state: State) -> FloatArray:
        position, direction = state.position @ row, sign(state.velocity @ row)
        return along(row, direction * np.cos(waves * position), direction * np.sin(waves * position))

    def parts(values: FloatArray) -> SimulatedParts:
        reach = float(np.abs(row) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))) + _MARGIN

        def curve(position: FloatArray) -> FloatArray:
            return np.asarray(values[0] * np.cos(waves * position) + values[1] * np.sin(waves * position))

        table = Table.of(curve, -reach, reach)
        return SimulatedParts(friction=(FrictionTorque(row, row, sign, position_row=row, curve=table),))

    unit = torque_unit(robot, place)
    names = (f"Fq_cos{number(place)}", f"Fq_sin{number(place)}")
    return Parameters(names, (unit, unit), (ANY, ANY)), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (Shape("waves", "1/rad", (0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0), 0.5, 8.0),)


POSITION_DEPENDENT_FRICTION = Family(
    "position_dependent_friction",
    "dry friction that depends on the position of the joint",
    "drive",
    each_drive,
    _make,
    _shapes,
    contains=("coulomb_friction",),
    several=True,
    confused_with=("load_dependent_friction",),
)
