"""Torque ripple: cogging of motor and drive, periodic in the motor's angle."""

from __future__ import annotations

import numpy as np

from ident.effects.effect import State
from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    as_positions_show,
    drive_row,
    each_drive,
    number,
    torque_unit,
)
from ident.effects.simulated import PositionTorque, SimulatedParts, Table
from robots.arrays import FloatArray
from robots.description import Robot

PERIODS = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)
"""Per turn of the motor: once for a run-out, twice for a wave generator, pole pairs and their multiples."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, (periods,) = drive_row(robot, place), shape
    waves = periods * robot.drive[place.joints[0]].gear

    def law(state: State) -> FloatArray:
        phase = waves * (state.position @ row)
        return as_positions_show(robot, state, along(row, np.cos(phase), np.sin(phase)))

    def parts(values: FloatArray) -> SimulatedParts:
        reach = float(np.abs(row) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))) + 0.1

        def curve(position: FloatArray) -> FloatArray:
            return np.asarray(values[0] * np.cos(waves * position) + values[1] * np.sin(waves * position))

        return SimulatedParts(
            position=(PositionTorque(row, row, Table.of(curve, -reach, reach), side="drive"),)
        )

    unit = torque_unit(robot, place)
    names = (f"ripple_cos{number(place)}", f"ripple_sin{number(place)}")
    return Parameters(names, (unit, unit), (ANY, ANY)), law, parts


def ripple_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Periods per turn of the motor are whole numbers: tried, not refined."""
    return (Shape("periods_per_turn", "1", PERIODS, 1.0, PERIODS[-1], fixed=True),)


TORQUE_RIPPLE = Family(
    "torque_ripple",
    "torque that is periodic in the motor's angle",
    "drive",
    each_drive,
    _make,
    ripple_shapes,
    confused_with=("gear_ripple",),
    several=True,
)
