"""What a controller adds to its control signal that the description does not say, measured and simulated.

A simulated loop that lacks a feed-forward leaves its torque at every joint, and whatever is asked of that
loop is asked of another arm. The signal is known, though: set-points, positions and the control signal are
recorded, so what the described law makes of the first two stands beside the third. The difference is the
controller's alone. A play, a soft gear or a payload moves positions and control signal as the law has it, and
no part of the difference; where the described gains are wrong, by ΔK, it has ΔK times the following error.

Of a motion that repeats the mean over its periods is taken. Where nothing repeats the difference holds all
noise of the recorded control signal, which stands in the torque that the arm is judged by, and a loop that is
led by it would follow that noise. What a controller knows beforehand is the set-points: what is taken then is
the part that least squares makes of the usual model's columns along them, torque of links, drives and
friction, each joint's with factors of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.closed_loop.integral_rule import as_it_integrates, at_limit, replayed
from ident.discrepancy.loop import SETTLING
from ident.discrepancy.repeats import not_repeating, repeat_length
from ident.effects import State
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from ident.signals import motion
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

_ABOVE = 2.0
"""Times the power of noise from which on a power is not noise's: as much again is something else."""

_THINNED = 4
"""Samples of which least squares takes one: set-points change little from one to the next."""

_DEPENDENT = 1e-6
"""Of unit columns: a direction with less is one that the set-points do not show."""


@dataclass(frozen=True)
class FeedForward:
    """What the described law does not make of one recording's control signal.

    Attributes:
        recording: as it was recorded.
        beside: (samples, n) control signal: of a repeated motion the mean over its periods, else what of it
            the set-points make.
        power: (n,) of that after the settling.
        noise: (n,) power that says nothing: of what does not repeat in the control signal; where nothing
            repeats, of the share that gate 1 lets a model lack.
        repeats: whether the motion repeats.
    """

    recording: Recording
    beside: FloatArray
    power: FloatArray
    noise: FloatArray
    repeats: bool

    @property
    def there(self) -> BoolArray:
        """(n,) drives of which it is more than noise."""
        return np.asarray(self.power > _ABOVE * self.noise)

    def added(self, drives: BoolArray) -> Recording:
        """The recording with it among what is added to the control signal of some drives (n,)."""
        more = np.where(drives, self.beside, 0.0)
        known = self.recording.added
        return replace(self.recording, added=more if known is None else known + more)


def with_feed_forward(
    robot: Robot, recordings: Sequence[Recording]
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Recordings with what their drives add beside the described law, and a sentence of what that is.

    Whether there is any is told by motions that repeat, where there are some; it is added to the others as
    measured: an encoder's noise goes through the described law, so no part of it is in what is beside it.

    Args:
        robot: controller and transmission.
        recordings: of one arm.
    """
    found = [unknown_feed_forward(robot, one) for one in recordings]
    known = [one for one in found if one is not None]
    repeated = [one for one in known if one.repeats]
    drives = _any([one.there for one in repeated or known], robot.n)
    if not drives.any():
        return tuple(recordings), ()
    torque = np.sqrt(np.max([one.power for one in known], axis=0)) * np.abs(robot.gains)
    sizes = [f"{torque[k]:.3g} {robot.joint[k].torque_unit} on drive {k + 1}" for k in np.flatnonzero(drives)]
    words = (
        f"the controller adds an unknown feed-forward of {', '.join(sizes)}, and the closed loop is simulated"
        " with what was measured of it; if it has none, [controller] of robot.toml is not the arm's:"
        " `armhil controller` identifies it"
    )
    pairs = zip(recordings, found, strict=True)
    return tuple(one if more is None else more.added(drives) for one, more in pairs), (words,)


def unknown_feed_forward(robot: Robot, recording: Recording) -> FeedForward | None:
    """What the recorded drives add beside the described law.

    Args:
        robot: controller and transmission.
        recording: set-points, positions and control signals.

    Returns:
        None where the law is not described, no reference or not every sample of the controller was recorded,
        or more than the torque of a joint is left: then another law is at work than the described one.
    """
    controller, reference = robot.controller, recording.reference
    start = round(SETTLING / recording.sample_time)
    if reference is None or not controller.is_given or recording.time.shape[0] <= 2 * start:
        return None
    if round(recording.sample_time / controller.sample_time) != 1:
        return None
    period = repeat_length(reference, recording.sample_time)
    signal, beside = recording.control_signal, _beside_law(robot, recording)
    repeats = period is not None and signal.shape[0] - start > period
    if period is not None and repeats:
        beside = _over_periods(_without_drift(beside, start, period, robot), start, period)
        noise = np.mean(not_repeating(signal, period) ** 2, axis=0)
    else:
        beside = _without_drift(beside, start, signal.shape[0] - start - 1, robot)
        beside = _of_set_points(robot, recording, beside)
        noise = robot.identification.torque_margin**2 * np.mean(signal**2, axis=0)
    power = np.mean(beside[start:] ** 2, axis=0)
    limits = np.array([joint.torque for joint in robot.joint])
    if (np.sqrt(power) * np.abs(robot.gains) > limits).any():
        return None
    return FeedForward(recording, beside, power, noise, repeats)


def _beside_law(robot: Robot, recording: Recording) -> FloatArray:
    """(samples, n) control signal less what the described law makes of set-points and positions.

    Up to a constant and, by rounding that is summed up, a drift where the law has an integral.
    """
    robot = as_it_integrates(robot, recording)
    controller = robot.controller
    assert recording.reference is not None
    proportional, rate = replayed(robot, recording, recording.reference)
    late = controller.delay_samples
    signal = recording.control_signal
    # What the last samples put out comes after the record's end.
    later = np.concatenate([signal[late:], np.repeat(signal[-1:], late, axis=0)])
    limited = at_limit(controller, later)
    known = proportional + controller.sample_time * (np.cumsum(rate, axis=0) - rate)
    if recording.added is not None:
        known = known + recording.added
    beside = later - known
    if late:
        beside[-late:] = beside[-late - 1]
    return _through_limits(robot, recording, beside, limited) if limited.any() else np.asarray(beside)


def _through_limits(robot: Robot, recording: Recording, beside: FloatArray, limited: BoolArray) -> FloatArray:
    """The same where drives come to their limit: there the limit is recorded, whatever is asked for.

    How far an integral goes on in the limit no two firmwares agree, so each stretch between limits has
    a level of its own that is not looked at. In the limit it is what the set-points make of it elsewhere.
    (A saturation that explains its positions to 5 µrad was refuted by a loop that was fed such levels, and
    left 7 mrad.)
    """
    free = np.asarray(~limited.any(axis=1))
    stretch = np.cumsum(np.diff(free.astype(np.int64), prepend=0) == 1)
    inside = free[:, np.newaxis] & (stretch[:, np.newaxis] == 1 + np.arange(stretch[-1]))
    made = _of_set_points(robot, recording, beside, inside.astype(np.float64))
    rest, samples = beside - made, np.arange(beside.shape[0])
    levels = (inside.T @ rest) / np.maximum(inside.sum(axis=0), 1)[:, np.newaxis]
    integrates = np.array(robot.controller.integral_gain) > 0.0
    rest = np.where(integrates, rest - inside @ levels, rest)
    if free.any():
        rest = np.stack([np.interp(samples, samples[free], one[free]) for one in rest.T], axis=1)
    return np.asarray(made + rest)


def _of_set_points(
    robot: Robot, recording: Recording, beside: FloatArray, levels: FloatArray | None = None
) -> FloatArray:
    """(samples, n) what of control signals the usual model's columns along the set-points make.

    Args:
        robot, recording: as above.
        beside: (samples, n) the signals.
        levels: (samples, k) ones in each stretch that counts, which has a level beside; None for one of all,
            which is part of what they make.
    """
    assert recording.reference is not None
    settings = robot.identification.model_copy(update={"trim_samples": (0, 0)})
    asked = motion(recording.time, recording.reference, settings)
    columns = base_parameters(RegressorModel.of(robot)).columns(
        State(asked.position, asked.velocity, asked.acceleration, asked.time)
    )
    torque, found = robot.joint_torque(beside), np.zeros_like(beside)
    constant = np.ones((torque.shape[0], 1)) if levels is None else levels
    used = np.flatnonzero(constant.any(axis=1))[::_THINNED]
    for joint, wanted in enumerate(torque.T):
        own = np.concatenate([columns[:, joint], constant], axis=1)
        own = own / np.maximum(np.linalg.norm(own, axis=0), 1e-12)
        factors = np.linalg.lstsq(own[used], wanted[used], rcond=_DEPENDENT)[0]
        if levels is not None:
            factors[columns.shape[2] :] = 0.0
        found[:, joint] = own @ factors
    return np.asarray(robot.control_signal(found))


def _without_drift(beside: FloatArray, start: int, apart: int, robot: Robot) -> FloatArray:
    """Less a line and the mean, which an integral holds, for drives that have one.

    Args:
        beside: (samples, n).
        start: sample from which on it counts.
        apart: samples between values that differ by the drift alone.
        robot: says which drives have an integral.
    """
    used = beside[start:]
    slope = np.mean(used[apart:] - used[:-apart], axis=0) / apart
    level = beside - (np.arange(beside.shape[0]) - start)[:, np.newaxis] * slope
    level = level - level[start : start + used.shape[0] // apart * apart].mean(axis=0)
    integrates = np.array(robot.controller.integral_gain) > 0.0
    return np.asarray(np.where(integrates, level, beside))


def _over_periods(values: FloatArray, start: int, period: int) -> FloatArray:
    """At each sample the mean of its phase from ``start`` on, where each has come once; (samples, n)."""
    phase = np.arange(values.shape[0]) % period
    total = np.zeros((period, values.shape[1]))
    np.add.at(total, phase[start:], values[start:])
    return np.asarray((total / np.bincount(phase[start:], minlength=period)[:, np.newaxis])[phase])


def _any(flags: Sequence[BoolArray], n: int) -> BoolArray:
    return np.asarray(np.any(flags, axis=0)) if flags else np.zeros(n, dtype=np.bool_)
