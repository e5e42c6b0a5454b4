"""Saturation: a drive whose torque stops growing below the limit that it is thought to have."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    each_limited_drive,
    torque_unit,
)
from ident.effects.shown import of_what_is_asked
from ident.effects.simulated import DriveChange, SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

_LEAST, _STEP, _STEPS = 0.02, 1.1, 41
"""Of the described limit: the smallest that is looked for, and how far one is from the next. A setting may be
any, and what is asked for beyond it a few per cent of it."""


def _torque_limit(robot: Robot, drive: int) -> float:
    """Torque at the drive output that the described saturation allows."""
    return float(robot.controller.saturation[drive] * abs(robot.gains[drive]))


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """What the control signal asks for beyond the limit never becomes torque."""
    drive, row, (limit,) = place.joints[0], drive_row(robot, place), shape

    def law(state: State) -> FloatArray:
        if state.torque is None:
            return np.zeros((*state.position.shape, 1))
        beyond = of_what_is_asked(robot, drive, state, lambda asked: asked - np.clip(asked, -limit, limit))
        return along(row, beyond)

    def parts(values: FloatArray) -> SimulatedParts:
        signal = limit / abs(float(robot.gains[drive]))
        return SimulatedParts(drives=(DriveChange(drive, limit=signal),))

    return Parameters(("excess",), ("1",), ((0.0, 1.5),), (0.1,), (1.0,), True), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    limit = _torque_limit(robot, place.joints[0])
    grid = tuple(limit * _LEAST * _STEP**number for number in range(_STEPS))
    return (Shape("torque_limit", torque_unit(robot, place), grid, _LEAST * limit, limit, True),)


SATURATION = Family(
    "saturation",
    "torque that stops growing below the described limit",
    "drive",
    each_limited_drive,
    _make,
    _shapes,
    confused_with=("drive_gain_error",),
    settled_by="run the same motion at half the speed: what saturates is gone",
    told_from={
        "drive_gain_error": (
            "run the same motion at half the speed: what saturates is gone, a wrong gain stays"
        ),
    },
    equation=(
        "what the control signal asks for beyond the limit; `excess` is 1 where none of it becomes torque"
    ),
    row=190,
)
