"""Torque-constant droop: iron that saturates, so that a large current makes less torque than its size says.

The torque of a motor with permanent magnets is in proportion to its current until the teeth of the stator
saturate, and bends down beyond (Hanselman, Brushless Permanent Magnet Motor Design, 2003). Turned around, a
torque τ asks for τ·(1 + droop·|τ/τ_max|^power), where a power of two is the first that even iron allows.
"""

from __future__ import annotations

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
    drive_torque,
    each_drive,
)
from ident.effects.scales import rated_torque
from ident.effects.simulated import DriveChange, SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

_DROOP = 0.15
"""Deviation of the further current at the torque limit, a share: makers let peak currents lose that much."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, row, largest = place.joints[0], drive_row(robot, place), rated_torque(robot, place)
    (power,) = shape

    def law(state: State) -> FloatArray:
        torque = drive_torque(robot, present.torque(state), drive)
        return along(row, torque * np.abs(torque / largest) ** power)

    def parts(values: FloatArray) -> SimulatedParts:
        droop = float(values[0]) * (abs(float(robot.gains[drive])) / largest) ** power
        return SimulatedParts(drives=(DriveChange(drive, droop=droop, droop_power=power),))

    return Parameters(("droop",), ("1",), (POSITIVE,), (_DROOP,)), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (Shape("power", "1", (2.0,), 1.0, 6.0, limits=(0.0,)),)


TORQUE_CONSTANT_DROOP = Family(
    "torque_constant_droop",
    "a drive gain that falls as the current grows",
    "drive",
    each_drive,
    _make,
    _shapes,
    confused_with=("drive_gain_error", "saturation"),
    settled_by=("press the joint against a force gauge with growing current: the force bends down"),
    told_from={
        "drive_gain_error": "run the same motion at half the speed: a droop is gone, a wrong gain stays",
        "saturation": (
            "press the joint against a force gauge with growing current: a limit is a corner, a droop bends"
        ),
    },
    equation=(
        "droop·|τ/τ_max|^power·τ with the drive's torque τ and the joint's torque limit τ_max: what the "
        "control signal asks for beyond the torque that it makes"
    ),
    row=195,
)
