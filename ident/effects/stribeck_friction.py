"""Stribeck friction: dry friction that falls as the film of lubricant builds up with speed."""

from __future__ import annotations

import numpy as np

from ident.effects.effect import State
from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    angle_unit,
    drive_row,
    each_drive,
    number,
    speed_limit,
    torque_unit,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_STATIC_SHARE = 0.004
"""Of the speed limit: friction that falls within less than this shows at breakaway alone."""

_EXPONENT = Shape("exponent", "1", (1.0, 2.0), 0.5, 4.0, fixed=True)
"""1 is Tustin's form of the fall, 2 that of Gauss."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, (stribeck_speed, exponent) = drive_row(robot, place), friction_sign(robot), shape

    def over_speed(speed: FloatArray) -> FloatArray:
        return sign(speed) * np.exp(-(np.abs(speed / stribeck_speed) ** exponent))

    def law(state: State) -> FloatArray:
        return along(row, over_speed(state.velocity @ row))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(friction=(FrictionTorque(row, values[0] * row, over_speed),))

    return Parameters((f"Fs{number(place)}",), (torque_unit(robot, place),), (POSITIVE,)), law, parts


def _moving_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    limit = speed_limit(robot, drive_row(robot, place))
    grid = tuple(float(limit * share) for share in (0.005, 0.01, 0.02, 0.04, 0.08, 0.16))
    unit = f"{angle_unit(robot, place)}/s"
    return (Shape("stribeck_speed", unit, grid, _STATIC_SHARE * limit, 0.4 * limit, True), _EXPONENT)


def _breakaway_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    limit = speed_limit(robot, drive_row(robot, place))
    grid = tuple(float(limit * share) for share in (0.0005, 0.001, 0.002))
    unit = f"{angle_unit(robot, place)}/s"
    return (Shape("breakaway_speed", unit, grid, 0.0002 * limit, _STATIC_SHARE * limit, True), _EXPONENT)


STRIBECK_FRICTION = Family(
    "stribeck_friction",
    "dry friction that falls with speed as the lubricant's film builds up",
    "drive",
    each_drive,
    _make,
    _moving_shapes,
    contains=("coulomb_friction",),
    confused_with=("nonlinear_viscous_friction", "static_friction"),
)
STATIC_FRICTION = Family(
    "static_friction",
    "friction to break away from standstill that is larger than friction in motion",
    "drive",
    each_drive,
    _make,
    _breakaway_shapes,
    contains=("coulomb_friction",),
    evidence="reversal",
    confused_with=("stribeck_friction", "hysteresis"),
)
