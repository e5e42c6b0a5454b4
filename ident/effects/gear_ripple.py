"""Gear ripple: a kinematic error of the gear, periodic in the motor's angle, that moves the link.

The gear gives way to the torque that this takes (Tuttle and Seering 1996): with the drive held the links
swing on it at some frequency f₀, and an error of frequency f acts as if it were 1/(1 − (f/f₀)²) as large.
"""

from __future__ import annotations

import numpy as np

from ident.effects.elastic_gear import inertia_along, link_inertia
from ident.effects.family import Place, PresentModel, Shape
from ident.effects.giving_way import torque_through_gears
from ident.effects.moved_links import slopes_of_links
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    angle_unit,
    drive_row,
    drive_torque,
    each_geared_drive,
)
from ident.effects.shown import as_filter_shows
from ident.effects.simulated import GearError, GearSpring, SimulatedParts, Table
from ident.effects.state import State
from ident.effects.torque_ripple import motor_angle, ripple_shapes
from robots.arrays import FloatArray
from robots.description import Robot

_ERROR = 3e-4
"""rad (or m), deviation of the error: one minute of arc, what makers promise."""

_DAMPING = 0.03
"""Of the links on the gear, ratio to critical: that of steel and grease."""

_NEAREST = 0.8
"""Of the resonance: no error is taken for larger than one of this frequency."""

_RESONANCE = Shape("resonance", "Hz", (200.0,), 60.0, 1000.0, True)
"""Of the links on the gear in the home posture; the gear of the last is rigid to all that a record shows."""


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (*ripple_shapes(robot, place), _RESONANCE)


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, (periods, resonance) = place.joints[0], shape
    row = drive_row(robot, place)
    back: FloatArray = np.asarray(np.linalg.inv(robot.transmission_matrix)[:, drive])
    waves = periods * motor_angle(robot, place)
    stiffness = link_inertia(robot, drive) * (2.0 * np.pi * resonance) ** 2
    damping = 2.0 * _DAMPING * stiffness / (2.0 * np.pi * resonance)

    def law(state: State) -> FloatArray:
        still = torque_through_gears(present, state)
        columns = np.stack([_torque(state, still, quarter) for quarter in (0.5 * np.pi, 0.0)], axis=2)
        frequency = waves * np.abs(state.velocity @ row) / (2.0 * np.pi)
        size = as_filter_shows(robot, frequency, state.time) * _given_way(state, frequency)
        return columns * size[:, np.newaxis, np.newaxis]

    def _given_way(state: State, frequency: FloatArray) -> FloatArray:
        """(samples,) how much larger the links' motion is than the error."""
        mass = present.link_mass_matrix(state.position)
        inertia = inertia_along(mass, back, link_inertia(robot, drive))
        ratio = 2.0 * np.pi * frequency * np.sqrt(inertia / stiffness)
        return np.asarray(1.0 / (1.0 - np.minimum(ratio, _NEAREST) ** 2))

    def _torque(state: State, still: FloatArray, lead: float) -> FloatArray:
        """Change of joint torque per rad of the error sin(phase + lead)."""
        phase = waves * (state.position @ row) + lead
        speed, push = waves * (state.velocity @ row), waves * (state.acceleration @ row)
        error = np.sin(phase)
        error_rate = np.cos(phase) * speed
        error_push = np.cos(phase) * push - np.sin(phase) * speed**2
        ahead = slopes_of_links(present, state, drive, back).torque(np.stack([error, error_rate, error_push]))
        # The error's slope is a lever: what passes through an inexact gear is power, not torque.
        lever = waves * np.cos(phase) * drive_torque(robot, still, drive)
        return np.asarray(ahead + np.outer(lever, row))

    def parts(values: FloatArray) -> SimulatedParts:
        reach = float(np.abs(row) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))) + 0.1

        def error(position: FloatArray) -> FloatArray:
            return np.asarray(values[0] * np.cos(waves * position) + values[1] * np.sin(waves * position))

        return SimulatedParts(
            springs=(GearSpring(drive, 1.0 / stiffness, damping),),
            errors=(GearError(drive, Table.of(error, -reach, reach)),),
        )

    unit = angle_unit(robot, place)
    symbols = ("gear_error_cos", "gear_error_sin")
    return Parameters(symbols, (unit, unit), (ANY, ANY), (_ERROR, _ERROR)), law, parts


GEAR_RIPPLE = Family(
    "gear_ripple",
    "kinematic error of the gear, periodic in the motor's angle",
    "drive",
    each_geared_drive,
    _make,
    _shapes,
    confused_with=("torque_ripple",),
    several=True,
    settled_by="uncouple the motor and turn it alone: an error of the gear is gone",
    told_from={
        "torque_ripple": (
            "uncouple the motor and turn it alone: ripple of the torque stays, an error of the gear is gone"
        ),
    },
    timeless=True,
    equation=(
        "the output is ahead of the input by gear_error_cos·cos + gear_error_sin·sin of "
        "periods_per_turn times the motor's angle; it accelerates the links and is a lever for "
        "the torque through the gear, which gives way: in the home posture the links swing on the"
        " held drive at `resonance`"
    ),
    row=150,
)
