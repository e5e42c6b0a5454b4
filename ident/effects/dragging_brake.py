"""Dragging brake: a brake that rubs for a time though it is lifted, or lifts late, or falls in.

A spring-applied brake that is lifted all the way has a small drag of constant size, which is a part of the
Coulomb friction (VDI 2241 part 1: drag torque). One whose coil gets too little voltage for a time rubs
meanwhile: dry friction that comes and goes with time, from one instant on, up to it, or again and again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    each_drive,
    over_time,
    torque_unit,
)
from ident.effects.scales import dry_friction
from ident.effects.shown import as_positions_show
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

_SHARE = 0.3
"""Of dry friction, deviation of a drag."""


def _again(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A drag in a part of each period, and none in the rest of it."""
    period, share, beginning = shape
    return _drag(robot, place, lambda time: np.mod(time / period - beginning, 1.0) < share)


def _periods(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Frequencies that differ by a tenth of a period after 20 s, as far as the quickest."""
    grid = tuple(1.0 / (0.005 * k) for k in range(200, 19, -1))
    return (
        Shape("period", "s", grid, 1.0, 10.0, True, scanned="time"),
        Shape("share", "1", (0.2, 0.35, 0.5, 0.65, 0.8), 0.05, 0.95, scanned="time"),
        Shape("beginning", "1", tuple(0.1 * k for k in range(10)), -0.5, 1.5, scanned="time"),
    )


def _once(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A drag from an instant on (1), or up to it (−1)."""
    instant, side = shape
    return _drag(robot, place, lambda time: side * (time - instant) > 0.0)


def _drag(
    robot: Robot, place: Place, rubs: Callable[[FloatArray], BoolArray]
) -> tuple[Parameters, Law, Parts]:
    """Dry friction at the times (s) at which a brake rubs; it comes and goes within a row."""
    row, sign = drive_row(robot, place), friction_sign(robot)

    def law(state: State) -> FloatArray:
        direction = sign(state.velocity @ row)
        if state.time is None:
            return along(row, direction)
        course = as_positions_show(robot, state, rubs(state.time)[:, np.newaxis].astype(np.float64))
        return along(row, direction * course[:, 0])

    def parts(values: FloatArray) -> SimulatedParts:
        table = over_time(lambda time: rubs(time).astype(np.float64))
        return SimulatedParts(friction=(FrictionTorque(row, values[0] * row, sign, course=table),))

    unit, scale = torque_unit(robot, place), _SHARE * dry_friction(robot, place)
    return Parameters(("drag",), (unit,), (POSITIVE,), (scale,)), law, parts


def _instants(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (
        Shape("instant", "s", (3.0, 7.0, 14.0), 0.5, 600.0, True),
        Shape("side", "1", (1.0, -1.0), -1.0, 1.0, fixed=True),
    )


BRAKE_THAT_FALLS_IN = Family(
    "dragging_brake",
    "a brake that rubs from an instant on, or up to it",
    "drive",
    each_drive,
    _once,
    _instants,
    contains=("coulomb_friction",),
    history=True,
)
DRAGGING_BRAKE = Family(
    "dragging_brake",
    "a brake that rubs now and then",
    "drive",
    each_drive,
    _again,
    _periods,
    contains=("coulomb_friction",),
    confused_with=("coulomb_friction", "drifting_friction"),
    forms=(BRAKE_THAT_FALLS_IN,),
    history=True,
    settled_by=(
        "measure the voltage at the brake's coil while the arm moves, or lift the brake by hand and record"
        " again"
    ),
    told_from={
        "coulomb_friction": (
            "lift the brake by hand and record again: its drag is gone, a gear's friction is not. One that"
            " rubs all the time is Coulomb friction, and no motion tells the two apart"
        ),
        "drifting_friction": "lift the brake by hand and record again: its drag is gone, a drift is not",
    },
    not_by_motion=("coulomb_friction",),
    equation=(
        "sign(q̇)·drag while t/period − beginning, less its whole turns, is below share; or, where it rubs"
        " once, after the instant (`side` 1) or before it (−1)"
    ),
    row=95,
)
