"""Windows of safety that follow from other figures of a description, and what none of them may exceed.

A window that is computed can be made as wide as a barn door by a slip elsewhere (a gain without its zero); so
each has an absolute cap, and a description that asks for more is refused.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robots.arrays import FloatArray

if TYPE_CHECKING:
    from robots.description import Robot

LARGEST_WINDOW = {"revolute": 0.6, "prismatic": 0.1}
"""rad, m at the drive output: how far a drive may be from its set-point before the master stops it."""


def following_error_window(robot: Robot, cycle_time: float) -> FloatArray:
    """The largest drive-output error that the loop of the description can have and still be in control.

    At that error the controller's output is at its saturation while the arm moves at full speed;
    the set-point itself lags its target by up to two periods of interpolation, and reporting takes one.
    Never more than ``LARGEST_WINDOW``.

    Args:
        robot: with controller gains and velocity limits.
        cycle_time: s.

    Returns:
        (n,) rad or m at the drive output.
    """
    caps = [LARGEST_WINDOW[joint.kind] for joint in robot.joint]
    return np.minimum(loop_error(robot, cycle_time), caps)


def demanded_following_error(robot: Robot, speed: FloatArray) -> FloatArray:
    """The error with which the described loops follow at a speed.

    e = (1 − feed_forward) · |q̇| / position_gain of a cascade; times velocity_gain of a PD or PID loop.

    Args:
        robot: with controller.
        speed: (n,) of the drive outputs, rad/s or m/s.

    Returns:
        (n,) rad or m at the drive outputs.
    """
    controller = robot.controller
    share = np.maximum(0.0, 1.0 - np.array(controller.velocity_feed_forward))
    error = share * speed / np.array(controller.position_gain)
    if controller.type != "cascade_p_pi":
        error = error * np.array(controller.velocity_gain)
    return np.asarray(error)


def loop_error(robot: Robot, cycle_time: float) -> FloatArray:
    """As :func:`following_error_window`, whatever comes out."""
    controller = robot.controller
    speed = np.abs(robot.transmission_matrix) @ robot.velocity_limits
    lag = speed * np.maximum(0.0, 1.0 - np.array(controller.velocity_feed_forward))
    saturation, k_p, k_v = (
        np.array(values)
        for values in (controller.saturation, controller.position_gain, controller.velocity_gain)
    )
    if controller.type == "cascade_p_pi":
        error = (saturation / k_v + lag) / k_p
    else:
        error = (saturation + k_v * lag) / k_p
    return np.asarray(error + 3 * cycle_time * speed)
