"""Load-quadratic friction: dry friction that grows faster than in proportion to the torque through the gear.

The load's share of a rolling bearing's friction is f·(P/C)^y·P with y from 1/3 to 1/2 (Palmgren, Ball and
Roller Bearing Engineering, 1959): what a proportion leaves of that is a square, to first order.
"""

from __future__ import annotations

from dataclasses import replace

from ident.effects.family import Place, PresentModel
from ident.effects.gear_load import GearLoad, at_once, late_form
from ident.effects.placed import (
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    each_drive,
    torque_unit,
)
from ident.effects.scales import rated_torque
from ident.effects.simulated import SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_SHARE, _LOAD = 0.15, 0.3
"""Deviation of the friction over the load, as of ``mu``, and for what load: of the rated torque."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign = drive_row(robot, place), friction_sign(robot)
    load = GearLoad(robot, place, present, *shape)

    def law(state: State) -> FloatArray:
        return along(row, load.torque(state) ** 2 * sign(state.velocity @ row))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(friction=(load.friction(float(values[0]), "square"),))

    unit, scale = f"1/({torque_unit(robot, place)})", _SHARE / (_LOAD * rated_torque(robot, place))
    return Parameters(("mu_square",), (unit,), (POSITIVE,), (scale,)), law, parts


_AT_ONCE = Family(
    "load_quadratic_friction",
    "dry friction that grows with the square of the torque through the gear",
    "drive",
    each_drive,
    _make,
    at_once,
    confused_with=("load_dependent_friction", "coulomb_friction"),
    settled_by=(
        "lift three known weights at one slow speed and lower them: half the difference bends upwards over"
        " the weight"
    ),
    told_from={
        "load_dependent_friction": (
            "lift three known weights at one slow speed and lower them: half the difference is no straight"
            " line over the weight"
        ),
    },
    equation="mu_square·(torque through the gear)²·sign(q̇)",
)
LOAD_QUADRATIC_FRICTION = replace(_AT_ONCE, row=75, forms=(late_form(_AT_ONCE),))
