"""Time delay between channels: positions that are read later than the control signals beside them."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import Family, Law, Parameters, Parts, along, drive_torque, each_drive
from ident.effects.simulated import DriveChange, SimulatedParts
from ident.effects.state import State
from ident.even_spline import EvenSpline
from robots.arrays import FloatArray
from robots.description import Robot

_LEAST = 1e-4
"""s; the torque is linear in a shift of the motion this small."""
_ABOUT = 2.0
"""A delay is at most so many times longer or shorter than the shift of its column."""
_SHORT = 1e-3
"""s; the column of a shift this short stands for all that is shorter, too."""
_FEWEST = 4
"""Samples that a motion can be shifted with."""
_SHIFTS = (-0.012, -0.007, -0.003, -0.001, 0.001, 0.003, 0.007, 0.012)
"""s; positive where positions are late, negative where control signals are."""


def _places(robot: Robot) -> tuple[Place, ...]:
    """The whole arm at once, and each drive alone."""
    arm = (Place("arm", ()),) if robot.n > 1 else ()
    return (*arm, *each_drive(robot))


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A late reading shows the motion of some time ago; the torque is that of the motion farther on.

    A late control signal is that of the motion, of all drives, some time ago. The column is the change over a
    shift of the motion, per second; with a shift as long as the delay it is exact, where the torque's rate
    alone misses a quarter of what 10 ms make beyond a refit.
    """
    shift = float(np.copysign(max(abs(shape[0]), _LEAST), shape[0]))
    transmission = robot.transmission_matrix
    drives = list(place.joints) or list(range(robot.n))
    late = np.linalg.inv(transmission)[:, drives] @ transmission[drives]
    """Of joint motion (or, transposed, of joint torque) what these drives do."""

    def law(state: State) -> FloatArray:
        if state.time is None or state.time.shape[0] < _FEWEST:
            return np.zeros((*state.position.shape, 1))
        state = present.low_cutoff(state)
        if shift in _SHIFTS and shift < 0.0:  # every place asks for those
            change = state.once(present, ("ahead", shift), lambda: _change(present, state, shift)) @ late
        elif shift < 0.0:
            change = _change(present, state, shift) @ late
        else:
            change = _change(present, state, shift, late)
        return (change / shift)[:, :, np.newaxis]

    def parts(values: FloatArray) -> SimulatedParts:
        late = float(values[0])
        position, signal = max(0.0, late), max(0.0, -late)
        return SimulatedParts(
            drives=tuple(DriveChange(d, position_age=position, signal_age=signal) for d in drives)
        )

    return Parameters(("delay",), ("s",), (_of_about(shift),), (0.005,)), law, parts


def _change(
    present: PresentModel, state: State, shift: float, moving: FloatArray | None = None
) -> FloatArray:
    """Change of the torque, samples × joints, over a shift of the motion (s) of all joints, or as moving."""
    motion = np.stack([state.position, state.velocity, state.acceleration], axis=1)
    ahead = state.ahead(shift) if moving is None else motion + (state.ahead(shift) - motion) @ moving.T
    position, velocity, acceleration = np.ascontiguousarray(ahead.transpose(1, 0, 2))
    moved = state.moved(position, velocity, acceleration)
    return np.asarray(present.torque(moved) - present.torque(state))


def _of_about(shift: float) -> tuple[float, float]:
    """Delays that a shift's column stands for. Far from it the column is that of another effect: of a shift
    much longer than the delay it is nearly a lag's.
    """
    least = 0.0 if abs(shift) <= _SHORT else abs(shift) / _ABOUT
    low, high = (least, abs(shift) * _ABOUT) if shift > 0.0 else (-abs(shift) * _ABOUT, -least)
    return low, high


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (Shape("shift", "s", _SHIFTS, -0.03, 0.03),)


def _acting(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A drive's torque follows its control signal late: the signal is the torque of some time ahead."""
    (ahead,), drive = shape, place.joints[0]
    transmission = robot.transmission_matrix

    def law(state: State) -> FloatArray:
        if state.time is None or state.time.shape[0] < _FEWEST:
            return np.zeros((*state.position.shape, 1))
        time, state = state.time, present.low_cutoff(state)
        torque = drive_torque(robot, present.torque(state), drive)
        place = np.arange(time.size) + ahead / (time[1] - time[0])
        later = EvenSpline(torque[:, np.newaxis]).at(np.minimum(place, time.size - 1.0))[:, 0]
        return along(transmission[drive], (later - torque) / ahead)

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(drives=(DriveChange(drive, delay=max(0.0, float(values[0]))),))

    return Parameters(("delay",), ("s",), (_of_about(ahead),), (0.005,)), law, parts


def _acting_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    ahead = tuple(shift for shift in _SHIFTS if shift > 0.0)
    return (Shape("ahead", "s", ahead, _LEAST, 0.03, True),)


ACTING_LATE = Family(
    "time_delay",
    "torque that follows the control signal late",
    "drive",
    each_drive,
    _acting,
    _acting_shapes,
    timeless=True,
    equation="the control signal is the drive's torque of `ahead` later",
)
TIME_DELAY = Family(
    "time_delay",
    "positions that are read later than the control signals beside them",
    "arm",
    _places,
    _make,
    _shapes,
    confused_with=("current_loop_lag", "rotor_inertia"),
    forms=(ACTING_LATE,),
    taken_by_alignment=True,
    settled_by="lock the joint and step the control signal: a delay shifts the current",
    timeless=True,
    equation=(
        "how much later positions are read than control signals; a negative one means that "
        "control signals are late. Its `shift` is where the change of the torque is taken, at "
        "best the delay itself"
    ),
    row=250,
)
