"""Viscous friction that does not grow in proportion to the speed."""

from __future__ import annotations

import numpy as np

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
    speed_limit,
    torque_unit,
)
from ident.effects.scales import viscous_friction
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_GRID = (0.3, 0.5, 0.7, 1.5, 2.0, 3.0)


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """Torque at the drive's speed limit times (speed / limit) to a power, and a change of the linear part.

    Friction that bends has another slope, too: the power is not on top of the linear friction of a prior.
    """
    row, sign, (power,) = drive_row(robot, place), friction_sign(robot), shape
    limit = speed_limit(robot, row)

    def over_speed(speed: FloatArray) -> FloatArray:
        return sign(speed) * np.abs(speed / limit) ** power

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        return along(row, over_speed(speed), speed)

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(
            friction=(FrictionTorque(row, values[0] * row, over_speed),),
            damping=values[1] * np.outer(row, row),
        )

    torque = torque_unit(robot, place)
    symbols = ("Fn", "Fn_linear")
    units = (torque, f"{torque}·s/{angle_unit(robot, place)}")
    scale = (0.7 * viscous_friction(robot, place) * limit, 0.7 * viscous_friction(robot, place))
    return Parameters(symbols, units, (ANY, ANY), scale), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (Shape("power", "1", _GRID, 0.2, 4.0, limits=(0.0, 1.0)),)


NONLINEAR_VISCOUS_FRICTION = Family(
    "nonlinear_viscous_friction",
    "friction that grows with a power of the speed",
    "drive",
    each_drive,
    _make,
    _shapes,
    essential=(0,),
    contains=("viscous_friction", "coulomb_friction", "wrist_coupling"),
    confused_with=("stribeck_friction", "viscous_friction"),
    settled_by="run the joint at several constant speeds: the torque is no straight line",
    told_from={
        "stribeck_friction": (
            "let the joint creep at several constant speeds below a hundredth of its limit"
        ),
    },
    equation="Fn·sign(q̇)·|q̇/speed limit|^power + Fn_linear·q̇",
    row=60,
)
