"""Load-dependent friction: dry friction in proportion to the torque that passes through the gear.

Beside that of the load on the output there is a form of the torque on the motor's side, which holds the
friction itself: F = mu·|L + F·sign(q̇)|, so F = mu/(1 − mu)·|L| while the motor drives the load and
mu/(1 + mu)·|L| while it is driven by it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.gear_load import GearLoad, at_once, late_form
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
from ident.effects.simulated import SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_MOTOR_SHARE = Shape("motor_share", "1", (0.08, 0.22, 0.36), 0.0, 0.5)
"""Friction over the torque on the motor's side of the gear; one that loses more than half locks itself."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    law, parts = _of_load(GearLoad(robot, place, present, *shape), 1.0, 0.0)
    return Parameters(("mu",), ("1",), (POSITIVE,), (0.15,)), law, parts


def _make_of_motor_side(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    share, offset_at_link = shape
    law, parts = _of_load(GearLoad(robot, place, present, offset_at_link), share, share)
    return Parameters(("load_friction",), ("1",), ((0.0, 3.0),), (0.1,), (1.0,)), law, parts


def _of_load(load: GearLoad, size: float, share: float) -> tuple[Law, Parts]:
    """Per unit of its parameter size·|L|·s/(1 − share·s·sign(L)) with the friction's sign s."""
    row, sign = drive_row(load.robot, load.place), friction_sign(load.robot)

    def law(state: State) -> FloatArray:
        torque, direction = load.torque(state), sign(state.velocity @ row)
        return along(row, size * np.abs(torque) * direction / (1.0 - share * direction * np.sign(torque)))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(friction=(load.friction(size * float(values[0]), share=share),))

    return law, parts


def _motor_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (_MOTOR_SHARE, OFFSET_AT_LINK)


_OF_MOTOR_SIDE = Family(
    "load_dependent_friction",
    "dry friction that grows with the torque on the motor's side of the gear, which holds friction itself",
    "drive",
    each_drive,
    _make_of_motor_side,
    _motor_shapes,
    equation=(
        "with the torque L through the gear and s = sign(q̇):"
        " load_friction·motor_share·|L|·s/(1 − motor_share·s·sign(L)), a share of L and of friction itself"
    ),
)
_OF_OUTPUT = Family(
    "load_dependent_friction",
    "dry friction that grows with the torque through the gear",
    "drive",
    each_drive,
    _make,
    at_once,
    confused_with=("coulomb_friction", "drive_gain_error"),
    settled_by="record the same motion with a known payload: friction of the load grows",
    equation="mu·|torque through the gear|·sign(q̇)",
)
LOAD_DEPENDENT_FRICTION = replace(_OF_OUTPUT, row=70, forms=(late_form(_OF_OUTPUT), _OF_MOTOR_SIDE))
