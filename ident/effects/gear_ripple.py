"""Gear ripple: a kinematic error of the gear, periodic in the motor's angle, that moves the link."""

from __future__ import annotations

import numpy as np

from ident.effects.effect import State
from ident.effects.family import Place, PresentModel
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    angle_unit,
    as_filter_shows,
    drive_row,
    drive_torque,
    each_drive,
    number,
)
from ident.effects.simulated import GearError, SimulatedParts, Table
from ident.effects.torque_ripple import ripple_shapes
from robots.arrays import FloatArray
from robots.description import Robot

_SMALL = 1e-5
"""rad (or m); a step in which the torque is linear in the error."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, (periods,) = place.joints[0], shape
    row = drive_row(robot, place)
    back = np.linalg.inv(robot.transmission_matrix)[:, drive]
    waves = periods * robot.drive[drive].gear

    def law(state: State) -> FloatArray:
        still = present.link_torque(state)
        columns = np.stack([_torque(state, still, quarter) for quarter in (0.5 * np.pi, 0.0)], axis=2)
        left = as_filter_shows(robot, waves * np.abs(state.velocity @ row) / (2.0 * np.pi))
        return columns * left[:, np.newaxis, np.newaxis]

    def _torque(state: State, still: FloatArray, lead: float) -> FloatArray:
        """Change of joint torque per rad of the error sin(phase + lead)."""
        phase = waves * (state.position @ row) + lead
        speed, push = waves * (state.velocity @ row), waves * (state.acceleration @ row)
        error = np.sin(phase)
        error_rate = np.cos(phase) * speed
        error_push = np.cos(phase) * push - np.sin(phase) * speed**2
        moved = State(
            state.position + _SMALL * np.outer(error, back),
            state.velocity + _SMALL * np.outer(error_rate, back),
            state.acceleration + _SMALL * np.outer(error_push, back),
            state.time,
        )
        # The error's slope is a lever: what passes through an inexact gear is power, not torque.
        lever = waves * np.cos(phase) * drive_torque(robot, still, drive)
        return np.asarray((present.link_torque(moved) - still) / _SMALL + np.outer(lever, row))

    def parts(values: FloatArray) -> SimulatedParts:
        reach = float(np.abs(row) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))) + 0.1

        def error(position: FloatArray) -> FloatArray:
            return np.asarray(values[0] * np.cos(waves * position) + values[1] * np.sin(waves * position))

        return SimulatedParts(errors=(GearError(drive, Table.of(error, -reach, reach)),))

    unit = angle_unit(robot, place)
    names = (f"gear_error_cos{number(place)}", f"gear_error_sin{number(place)}")
    return Parameters(names, (unit, unit), (ANY, ANY)), law, parts


GEAR_RIPPLE = Family(
    "gear_ripple",
    "kinematic error of the gear, periodic in the motor's angle",
    "drive",
    each_drive,
    _make,
    ripple_shapes,
    confused_with=("torque_ripple",),
    several=True,
)
