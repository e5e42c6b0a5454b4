"""Time delay between channels: positions that are read later than the control signals beside them."""

from __future__ import annotations

import numpy as np

from ident.effects.effect import State
from ident.effects.family import Place, PresentModel
from ident.effects.placed import ANY, Family, Law, Parameters, Parts, each_drive, rate
from ident.effects.simulated import DriveChange, SimulatedParts
from robots.arrays import FloatArray
from robots.description import Robot

_STEP = 1e-4
"""s; the torque is linear in a shift of the motion this small."""


def _places(robot: Robot) -> tuple[Place, ...]:
    """The whole arm at once, and each drive alone."""
    arm = (Place("arm", ()),) if robot.n > 1 else ()
    return (*arm, *each_drive(robot))


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A late reading shows the motion of some time ago; the torque is that of a motion farther on."""
    transmission = robot.transmission_matrix
    drives = place.joints or tuple(range(robot.n))
    back = np.linalg.inv(transmission)[:, drives]
    late = back @ transmission[list(drives)]
    name = f"delay{place.joints[0] + 1}" if place.joints else "delay"

    def law(state: State) -> FloatArray:
        jerk = rate(state.acceleration, state)
        moved = State(
            state.position + _STEP * state.velocity @ late.T,
            state.velocity + _STEP * state.acceleration @ late.T,
            state.acceleration + _STEP * jerk @ late.T,
            state.time,
        )
        change = (present.torque(moved) - present.torque(state)) / _STEP
        return change[:, :, np.newaxis]

    def parts(values: FloatArray) -> SimulatedParts:
        delay = max(0.0, float(values[0]))
        return SimulatedParts(drives=tuple(DriveChange(drive, reading_delay=delay) for drive in drives))

    return Parameters((name,), ("s",), (ANY,)), law, parts


TIME_DELAY = Family(
    "time_delay",
    "positions that are read later than the control signals beside them",
    "arm",
    _places,
    _make,
    confused_with=("current_loop_lag",),
)
