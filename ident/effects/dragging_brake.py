"""Dragging brake: a brake that rubs for a time though it is lifted, or lifts late, or falls in.

A spring-applied brake that is lifted all the way has a small drag of constant size, which is a part of the
Coulomb friction (VDI 2241 part 1: drag torque). One whose coil gets too little voltage for a time rubs
meanwhile: dry friction that comes and goes with time, from one instant on, up to it, or again and again.
"""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape, State
from ident.effects.placed import (
    ANY,
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
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_SHARE = 0.3
"""Of dry friction, deviation of a drag."""


def _again(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A mean drag and the first wave of its coming and going."""
    row, sign, (period,) = drive_row(robot, place), friction_sign(robot), shape
    rate = 2.0 * np.pi / period

    def law(state: State) -> FloatArray:
        direction = sign(state.velocity @ row)
        if state.time is None:
            return along(row, direction, 0.0 * direction, 0.0 * direction)
        phase = rate * state.time
        return along(row, direction, direction * np.cos(phase), direction * np.sin(phase))

    def parts(values: FloatArray) -> SimulatedParts:
        def course(time: FloatArray) -> FloatArray:
            return np.asarray(values[0] + values[1] * np.cos(rate * time) + values[2] * np.sin(rate * time))

        table = over_time(course)
        return SimulatedParts(friction=(FrictionTorque(row, row, sign, course=table),))

    unit, scale = torque_unit(robot, place), _SHARE * dry_friction(robot, place)
    symbols = ("drag", "drag_cos", "drag_sin")
    return Parameters(symbols, (unit,) * 3, (POSITIVE, ANY, ANY), (scale,) * 3), law, parts


def _periods(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Frequencies that a recording of 20 s tells apart, as far as the quickest."""
    grid = tuple(1.0 / (0.05 * k) for k in range(20, 2, -1))
    return (Shape("period", "s", grid, 1.0, 10.0, True),)


def _once(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A drag from an instant on (1), or up to it (−1)."""
    row, sign, (instant, side) = drive_row(robot, place), friction_sign(robot), shape

    def rubs(time: FloatArray) -> FloatArray:
        return np.asarray(side * (time - instant) > 0.0, dtype=np.float64)

    def law(state: State) -> FloatArray:
        direction = sign(state.velocity @ row)
        return along(row, direction if state.time is None else direction * rubs(state.time))

    def parts(values: FloatArray) -> SimulatedParts:
        table = over_time(rubs)
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
    rough=True,
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
        "sign(q̇)·(drag + drag_cos·cos(2πt/period) + drag_sin·sin(2πt/period)) or, where it rubs once,"
        " sign(q̇)·drag after the instant (`side` 1) or before it (−1)"
    ),
    row=95,
)
