"""What a difference between robot and simulation is made of: functions of the simulated motion.

The simulation is free of noise, so whatever of a difference these functions explain is no noise either.
"""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray

_SPEEDS = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Quantiles of the speed in a direction at which the friction curve may bend."""


def torque_functions(position: FloatArray, velocity: FloatArray, torque: FloatArray) -> FloatArray:
    """Torques that a joint may have beyond the model's: samples × 12.

    A friction curve of any shape in either direction (eight columns: broken lines that jump at standstill),
    three of position, and friction that grows with the load.

    Args:
        position: (samples,) simulated, rad or m.
        velocity: (samples,) simulated, rad/s or m/s.
        torque: (samples,) of the simulated drive at the joint, N·m or N.
    """
    centre, reach = (position.max() + position.min()) / 2.0, (position.max() - position.min()) / 2.0
    place = (position - centre) / reach if reach > 0 else np.zeros_like(position)
    shape = [place, 1.5 * place**2 - 0.5, 2.5 * place**3 - 1.5 * place]
    load = np.sign(velocity) * np.abs(torque)
    return np.column_stack([_friction_curve(velocity), *shape, load])


def loop_functions(
    following: FloatArray, signal: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> FloatArray:
    """What a wrong controller makes of a drive's following error: samples × 6.

    The loop is linear, so a wrong gain shows in what drives it: the error itself, the control signal, speed
    and acceleration; a wrong delay or interpolation shows in speed and acceleration.

    Args:
        following: (samples,) simulated q_r − q of the drive, rad or m.
        signal: (samples,) simulated control signal.
        velocity: (samples,) simulated, of the drive.
        acceleration: (samples,) simulated, of the drive.
    """
    ones = np.ones_like(velocity)
    return np.column_stack([following, signal, velocity, acceleration, np.sign(velocity), ones])


def _friction_curve(velocity: FloatArray) -> FloatArray:
    """Hat functions of the speed, four for each direction: samples × 8."""
    columns = []
    for direction in (1.0, -1.0):
        speed = direction * velocity
        moving = speed > 0
        if not moving.any():
            columns += [np.zeros_like(velocity)] * len(_SPEEDS)
            continue
        knots = np.quantile(speed[moving], _SPEEDS)
        knots[0] = 0.0
        for k in range(len(_SPEEDS)):
            heights = np.eye(len(_SPEEDS))[k]
            columns.append(np.where(moving, np.interp(speed, knots, heights), 0.0))
    return np.column_stack(columns)
