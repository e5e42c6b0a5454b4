"""When the drives' integral takes in the present error: after a sample's output, or before it.

A description gives gains, not the order of two lines in a firmware. With the error taken in before the
output the law is the one of this package with other gains: v = K s + I with I ← I + K K_i T s first is
v = K(1 + K_i T) s + I with I ← I + K K_i T s afterwards. At 1 kHz that is 1.5 to 2.5 % of a gain, and half a
per cent or more of the following error. Which it is the recording says: v less what the law without present
error makes of the recorded set-points and positions holds a share of K K_i T s that is one or zero.
"""

from __future__ import annotations

import numpy as np

from ident.closed_loop.control_law import fed_forward
from ident.filters import recursion
from ident.preparation.set_points import set_point_accelerations, set_points
from ident.recording import Recording
from robots.arrays import BoolArray, FloatArray
from robots.description import Controller, Robot

_SURE = 3.0
"""Deviations by which the share lies above one half and below one and a half."""

_APART = 16
"""Samples between the two whose difference is looked at: slow motion changes little from one to the next."""

_AT_LIMIT = 0.99
"""Of the described saturation: a signal that is there, noise and all, may be one that asks for more."""

_FIRST_SAMPLES = 10
"""Left out: filters of the loop begin in a state that was not recorded."""


def as_it_integrates(robot: Robot, recording: Recording) -> Robot:
    """The arm with gains that have this package's order of integration do what the recorded drives do.

    Unchanged where the described order is that of the drives, or the recording does not say: no reference,
    no integral, more than one controller sample per recorded one.

    Args:
        robot: controller and transmission.
        recording: set-points, positions and control signals.
    """
    return _taken_in_first(robot) if integrates_first(robot, recording) else robot


def integrates_first(robot: Robot, recording: Recording) -> bool:
    """Whether the recorded drives take in the present error before their output, beyond doubt."""
    controller = robot.controller
    if recording.reference is None or not any(controller.integral_gain):
        return False
    if round(recording.sample_time / controller.sample_time) != 1:
        return False
    proportional, rate = replayed(robot, recording, recording.reference)
    late = controller.delay_samples
    signal = recording.control_signal[late:]
    end = signal.shape[0]
    grown = controller.sample_time * np.cumsum(rate, axis=0)
    taken = controller.sample_time * (rate[_APART:end] - rate[: end - _APART])
    before = np.concatenate([np.zeros_like(grown[:1]), grown[:-1]])
    rest = signal - proportional[:end] - before[:end]
    left = rest[_APART:] - rest[:-_APART]
    limited = at_limit(controller, signal)
    used = ~np.logical_or.reduce([limited[k : end - _APART + k] for k in range(_APART + 1)])
    used[:_FIRST_SAMPLES] = False
    top = bottom = 0.0
    for drive in np.flatnonzero(np.array(controller.integral_gain)):
        x, y = taken[used[:, drive], drive], left[used[:, drive], drive]
        if x.size < 2 or not x.any():
            continue
        noise = float(np.mean((y - x * float(x @ y) / float(x @ x)) ** 2)) + 1e-300
        top, bottom = top + float(x @ y) / noise, bottom + float(x @ x) / noise
    if bottom == 0.0:
        return False
    share, sigma = top / bottom, (_APART / bottom) ** 0.5
    return bool(0.5 + _SURE * sigma < share < 1.5 - _SURE * sigma)


def at_limit(controller: Controller, signal: FloatArray) -> BoolArray:
    """(samples, n) where a control signal is at the described saturation."""
    return np.asarray(np.abs(signal) >= _AT_LIMIT * np.array(controller.saturation))


def replayed(robot: Robot, recording: Recording, reference: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What each drive's law puts out without its integral, and the rate of that, (samples, n) each."""
    controller, step = robot.controller, recording.sample_time
    transmission = robot.transmission_matrix
    targets, position = reference @ transmission.T, recording.position @ transmission.T
    points, speeds = set_points(robot, targets, step, 1)
    reach = controller.velocity_difference_samples
    before = np.concatenate([np.repeat(position[:1], reach, axis=0), position[:-reach]])
    velocity = (position - before) / (reach * controller.sample_time)
    cutoff = controller.velocity_cutoff_hz
    if cutoff is not None:
        smoothing = 1.0 - float(np.exp(-2 * np.pi * cutoff * controller.sample_time))
        velocity = recursion(np.array([1.0, smoothing - 1.0]), smoothing * velocity)
    forward = np.array(controller.velocity_feed_forward) * speeds - velocity
    gain, integral = np.array(controller.velocity_gain), np.array(controller.integral_gain)
    error = points - position
    if controller.type == "cascade_p_pi":
        proportional = gain * (np.array(controller.position_gain) * error + forward)
        rate = integral * proportional
    else:
        proportional = np.array(controller.position_gain) * error + gain * forward
        rate = integral * error
    added = fed_forward(controller, speeds, set_point_accelerations(targets, step, 1))
    return (proportional + added if added.size else proportional), rate


def _taken_in_first(robot: Robot) -> Robot:
    controller: Controller = robot.controller
    step, integral = controller.sample_time, np.array(controller.integral_gain)
    changes: dict[str, tuple[float, ...]]
    if controller.type == "cascade_p_pi":
        more = 1.0 + step * integral
        changes = {
            "velocity_gain": tuple(np.array(controller.velocity_gain) * more),
            "integral_gain": tuple(integral / more),
        }
    else:
        changes = {"position_gain": tuple(np.array(controller.position_gain) + step * integral)}
    return robot.model_copy(update={"controller": controller.model_copy(update=changes)})
