"""Encoder eccentricity: a scale that turns about another point than its shaft, and reads a sine too much.

A scale of radius R whose middle lies e beside the axis reads up to e/R too much, once per turn of the
encoder (Renishaw, The accuracy of rotary encoders). The loop takes the reading for the place: rotor, gear
and links all move otherwise than the record says.
"""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    angle_unit,
    drive_row,
    each_drive,
)
from ident.effects.shown import as_filter_shows
from ident.effects.simulated import DriveChange, SimulatedParts, Table
from ident.effects.state import State
from ident.effects.torque_ripple import waves_per_period
from robots.arrays import FloatArray
from robots.description import Robot

_AT_ENCODER = 5e-3
"""rad of the encoder, deviation of the error: 0.1 mm beside the middle of a scale of 20 mm."""

_SMALL = 1e-2
"""Of an encoder's radian; a step in which the torque is linear in the error."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, row = place.joints[0], drive_row(robot, place)
    waves = shape[0] * waves_per_period(robot, place)
    back: FloatArray = np.asarray(np.linalg.inv(robot.transmission_matrix)[:, drive])

    def law(state: State) -> FloatArray:
        recorded = present.torque(state)
        columns = np.stack([_torque(state, recorded, quarter) for quarter in (0.5 * np.pi, 0.0)], axis=2)
        frequency = waves * np.abs(state.velocity @ row) / (2.0 * np.pi)
        return columns * as_filter_shows(robot, frequency, state.time)[:, np.newaxis, np.newaxis]

    def _torque(state: State, recorded: FloatArray, quarter: float) -> FloatArray:
        """Of a reading that is sin(waves·u + quarter) rad too large, u the drive's output as recorded."""
        step = _SMALL / waves
        phase, rate = waves * (state.position @ row) + quarter, waves * (state.velocity @ row)
        error, speed = step * np.sin(phase), step * np.cos(phase) * rate
        change = step * np.cos(phase) * waves * (state.acceleration @ row) - error * rate**2
        true = state.moved(
            state.position - np.outer(error, back),
            state.velocity - np.outer(speed, back),
            state.acceleration - np.outer(change, back),
        )
        return (present.torque(true) - recorded) / step

    def parts(values: FloatArray) -> SimulatedParts:
        reach = float(np.abs(row) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))) + 0.1

        def error(position: FloatArray) -> FloatArray:
            return np.asarray(values[0] * np.cos(waves * position) + values[1] * np.sin(waves * position))

        return SimulatedParts(drives=(DriveChange(drive, reading_error=Table.of(error, -reach, reach)),))

    unit, scale = angle_unit(robot, place), _AT_ENCODER / waves
    return Parameters(("reads_cos", "reads_sin"), (unit, unit), (ANY, ANY), (scale, scale)), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Turns of the encoder per turn (or m) of the drive output: it sits on the joint, or on the motor."""
    drive = place.joints[0]
    turns = [1.0] if robot.joint[drive].kind == "revolute" else []
    if robot.has_drives:
        turns.append(float(robot.drive[drive].gear))
    return (Shape("encoder_turns", "1", tuple(turns), min(turns), max(turns), fixed=True),)


def _with_an_encoder(robot: Robot) -> tuple[Place, ...]:
    """Drives of which it is known how often an encoder on joint or motor turns."""
    return tuple(
        place
        for place in each_drive(robot)
        if robot.has_drives or robot.joint[place.joints[0]].kind == "revolute"
    )


ENCODER_ECCENTRICITY = Family(
    "encoder_eccentricity",
    "an encoder that sits beside its axis and reads a sine too much once per turn",
    "drive",
    _with_an_encoder,
    _make,
    _shapes,
    confused_with=("torque_ripple", "gear_ripple"),
    settled_by="turn the shaft against a second encoder, or a dial gauge on its scale: it runs out of true",
    told_from={
        "torque_ripple": (
            "run the joint at two constant speeds: an encoder's ripple grows with the square of the speed, a"
            " torque's does not"
        ),
        "gear_ripple": "uncouple the gear and run the motor alone: the encoder's ripple stays",
    },
    timeless=True,
    equation=(
        "the reading is reads_cos·cos(encoder_turns·q) + reads_sin·sin(encoder_turns·q) too large; the "
        "torque is that of the whole model at the true motion less that at the recorded one"
    ),
    row=185,
)
