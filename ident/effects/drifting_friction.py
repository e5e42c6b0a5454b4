"""Friction that settles after a start, as a gear warms up."""

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
    angle_unit,
    drive_row,
    each_drive,
    number,
    torque_unit,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts, Table
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_LONGEST = 3600.0
"""s; a course that the simulation tabulates."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, (settling,) = drive_row(robot, place), friction_sign(robot), shape
    torque, angle = torque_unit(robot, place), angle_unit(robot, place)

    def course(time: FloatArray) -> FloatArray:
        return np.exp(-time / settling)

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        fading = np.ones_like(speed) if state.time is None else course(state.time)
        return along(row, fading * sign(speed), fading * speed)

    def parts(values: FloatArray) -> SimulatedParts:
        table = Table.of(course, 0.0, _LONGEST)
        terms = zip(values, (sign, None), strict=True)
        return SimulatedParts(
            friction=tuple(FrictionTorque(row, v * row, form, course=table) for v, form in terms)
        )

    names = (f"Fc_cold{number(place)}", f"Fv_cold{number(place)}")
    return Parameters(names, (torque, f"{torque}·s/{angle}"), (ANY, ANY)), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (Shape("settling_time", "s", (8.0, 25.0, 80.0, 400.0), 4.0, 2000.0, True),)


DRIFTING_FRICTION = Family(
    "drifting_friction",
    "friction that changes while the gear warms up",
    "drive",
    each_drive,
    _make,
    _shapes,
    contains=("coulomb_friction", "viscous_friction", "wrist_coupling"),
    confused_with=("coulomb_friction", "viscous_friction"),
)
