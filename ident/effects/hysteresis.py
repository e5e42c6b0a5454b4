"""Hysteresis of a gear: torque that builds up over the way after each reversal and stays."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

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
    torque_unit,
)
from ident.effects.scales import dry_friction
from ident.effects.simulated import Bristle, FrictionTorque, SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

_LENGTHS = (0.003, 0.01, 0.03, 0.1, 0.3)


def deflection(position: FloatArray, length: float, start: float = 0.0) -> FloatArray:
    """Deflection −1 to 1 of a bristle drawn along positions (samples,): dz/dx = (1 − z sign ẋ)/length.

    Exact for any way between samples, and no matter how fast (Dahl 1968).

    Args:
        position: rad (or m).
        length: rad (or m) of the way.
        start: deflection at the first sample.
    """
    way = np.diff(position, prepend=position[:1])
    state = np.empty_like(position)
    _kernel()(np.exp(-np.abs(way) / length), np.sign(way), start, state)
    return state


@cache
def _kernel() -> Callable[..., None]:
    """The recursion in machine code."""
    import numba  # takes a second to load; most commands need no bristle

    compiled: Callable[..., None] = numba.njit(error_model="numpy", nogil=True)(_draw)
    return compiled


def _draw(keep: FloatArray, towards: FloatArray, start: float, state: FloatArray) -> None:
    """Each step keeps a share of the deflection's distance from where the way leads; writes the state."""
    z = start
    for k in range(keep.shape[0]):
        z = towards[k] + (z - towards[k]) * keep[k]
        state[k] = z


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, (length,) = drive_row(robot, place), shape

    def law(state: State) -> FloatArray:
        if state.time is None:
            return np.zeros((*state.position.shape, 1))
        return along(row, deflection(state.position @ row, length))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(
            friction=(FrictionTorque(row, values[0] * row, Bristle(length, "exponential")),)
        )

    unit, scale = torque_unit(robot, place), (0.5 * dry_friction(robot, place),)
    return Parameters(("hysteresis",), (unit,), (POSITIVE,), scale), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (Shape("length", angle_unit(robot, place), _LENGTHS, 2e-3, 1.0, True),)


HYSTERESIS = Family(
    "hysteresis",
    "torque that builds up over the way after each reversal",
    "drive",
    each_drive,
    _make,
    _shapes,
    confused_with=("static_friction", "backlash"),
    shows="reversal",
    history=True,
    settled_by=(
        "push the resting joint there and back by less than it takes to break away: hysteresis comes back"
        " by another way"
    ),
    told_from={
        "static_friction": (
            "raise the torque of the resting joint slowly, lower it before it breaks away: hysteresis"
            " comes back by another way"
        ),
    },
    equation=(
        "a bristle (Dahl 1968) that is drawn along: dz/dq = (1 − z·sign(q̇))/length. It depends "
        "on the way alone, not on the speed, and takes energy: its torque is not negative"
    ),
    row=130,
)
