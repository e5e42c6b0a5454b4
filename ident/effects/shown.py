"""What the rows of a record show of torques that their filters change."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ident.effects.placed import drive_torque
from ident.effects.state import State
from ident.signals import low_pass_where_sampled
from robots.arrays import FloatArray
from robots.description import Robot


def as_positions_show(robot: Robot, state: State, torque: FloatArray) -> FloatArray:
    """Quick torques (samples × joints × p) through the filter of the positions.

    A torque quicker than the position loop moves the drive instead of being held, and of that motion the
    filter takes as much as it would of the torque: the model's two sides differ by the torque, filtered.
    Where the samples are too far apart for that filter there was none.
    """
    settings = robot.identification
    flat = torque.reshape(torque.shape[0], -1)
    alive = np.flatnonzero(flat.any(axis=0))
    smooth = np.zeros_like(flat)
    smooth[:, alive] = low_pass_where_sampled(
        flat[:, alive], state.time, settings.cutoff_hz, settings.filter_order
    )
    return smooth.reshape(torque.shape)


def of_what_is_asked(
    robot: Robot, drive: int, state: State, made: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """(samples,) of what a drive makes of the torque that it is asked for, as rows show it.

    It makes that of each sample, and a corner of a filtered torque is none of a filter's (of a drive at its
    limit rows lacked a tenth so, and what was beside it had no name).

    Args:
        robot, drive: whose output the torque is of.
        state: with a torque.
        made: of torques at the drive's output (samples,), each alone.
    """
    if state.asked is None:
        assert state.torque is not None
        return made(drive_torque(robot, state.torque, drive))
    whole = made(drive_torque(robot, state.asked.torque, drive))
    return np.asarray(state.asked.seen(whole[:, np.newaxis])[:, 0])


def as_filter_shows(robot: Robot, frequency: FloatArray, time: FloatArray | None) -> FloatArray:
    """(samples,) share of a wave that is left of it behind the filter of the positions.

    Args:
        robot: with cut-off and order of the filter, which goes forward and backward.
        frequency: (samples,) of the wave, Hz. It may be beyond half the sampling rate: such a wave looks slow
            in the samples, but has moved nothing and no control signal has answered it.
        time: (samples,) s, of the samples: a filter of samples lets more pass below its cut-off than one of
            the same order that knows the course between them (bilinear transform). None: for the latter.
    """
    settings = robot.identification
    over = frequency / settings.cutoff_hz
    if time is not None and time.shape[0] > 1:
        angle = np.pi * float(time[1] - time[0])
        if settings.cutoff_hz * angle < 0.5 * np.pi:
            known = frequency * angle < 0.5 * np.pi
            warped = np.tan(np.where(known, frequency * angle, 0.0)) / np.tan(settings.cutoff_hz * angle)
            over = np.where(known, warped, over)
    return np.asarray(1.0 / (1.0 + over ** (2 * settings.filter_order)))
