"""Dead zone of the command: a drive that answers no control signal up to a size, and lacks that size beyond.

τ = g_τ·(v − d·sign v) beyond |v| = d and nothing within (Tao and Kokotović, Adaptive Control of Systems with
Actuator and Sensor Nonlinearities, 1996). So a torque asks for d more in its own direction.
"""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel
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
from ident.effects.shown import as_positions_show, of_what_is_asked
from ident.effects.simulated import DriveChange, SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

_WIDTH = 0.02
"""Of the rated torque, deviation of the width: the least current that a drive controls."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, row = place.joints[0], drive_row(robot, place)

    def law(state: State) -> FloatArray:
        if state.torque is None:
            state = state.with_torque(present.torque(state))
        direction = along(row, of_what_is_asked(robot, drive, state, np.sign))
        return as_positions_show(robot, state, direction) if state.asked is None else direction

    def parts(values: FloatArray) -> SimulatedParts:
        width = float(values[0]) / abs(float(robot.gains[drive]))
        return SimulatedParts(drives=(DriveChange(drive, dead_zone=width),))

    unit, scale = torque_unit(robot, place), _WIDTH * rated_torque(robot, place)
    return Parameters(("dead_zone",), (unit,), (POSITIVE,), (scale,)), law, parts


COMMAND_DEAD_ZONE = Family(
    "command_dead_zone",
    "a drive that does not answer small control signals, and lacks that much of larger ones",
    "drive",
    each_drive,
    _make,
    contains=("coulomb_friction",),  # of a drive that pushes along its motion all the time
    confused_with=("coulomb_friction", "drive_gain_error", "stribeck_friction"),
    settled_by="lock the joint and raise the control signal slowly from zero: none flows in a dead zone",
    told_from={
        "coulomb_friction": (
            "turn the joint slowly under a load that pulls one way: a dead zone follows the torque,"
            " friction the direction"
        ),
    },
    equation="dead_zone·sign(τ) with the drive's torque τ",
    row=197,
)
