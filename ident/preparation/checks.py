"""Recordings that cannot be what they are said to be: found before anything is fitted to them.

Each mistake that is common in logs has its own sentence: a joint that stands still, channels that were
swapped, degrees in place of radians, a control signal that was not recorded.
"""

from __future__ import annotations

import numpy as np

from ident.errors import IdentificationError
from ident.ordered import percentile
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Robot

_DEGREES = 180.0 / np.pi
_STANDS_STILL = 1e-4
"""Share of a joint's range that a joint at rest may seem to move, by noise."""

_BEYOND = 0.05
"""Share of a joint's range by which a position may be beyond its limits: calibration, soft stops."""

_TOO_FAST = 1.5
"""Times the velocity limit."""

_SPEED_PERCENTILE = 99.0
"""Of the speeds, and of the torques; a few samples may be wrong."""

_TOO_STRONG = 20.0
"""Times the torque limit. A drive's peak is some three times its rating, and limits in published URDFs are
placeholders; a wrong unit is a factor of 1000, a forgotten gear one of 30 to 300."""

_RATHER_STRONG = 1.5
"""The same, from which on it is said."""

_SMOOTHER = 10.0
"""A position is the torque integrated twice: where the control signal is smoother by this factor, they are
swapped."""


def check_recordings(robot: Robot, recordings: tuple[Recording, ...]) -> tuple[str, ...]:
    """Refuse what is plainly wrong, and say what looks odd.

    Args:
        robot: the arm that the recordings are said to be of.
        recordings: in SI units and radians.

    Returns:
        Sentences of warning.

    Raises:
        IdentificationError: one line that names the recording, the joint and the likely mistake.
    """
    if not recordings:
        raise IdentificationError("no recording to identify from")
    warnings: list[str] = []
    for recording in recordings:
        _check_joints(robot, recording)
        _check_control_signal(recording)
        _check_order(recording)
        _check_units(robot, recording)
        warnings += _check_torque(robot, recording)
        warnings += _too_far_or_fast(robot, recording)
    _check_motion(robot, recordings)
    return tuple(warnings)


def _check_joints(robot: Robot, recording: Recording) -> None:
    if recording.joints != robot.n:
        raise IdentificationError(
            f"{recording.name}: {recording.joints} joints; allowed: {robot.n}, as {robot.name} has"
        )


def _check_order(recording: Recording) -> None:
    """Refuse positions and control signals that stand in each other's place."""
    position, signal = roughness(recording.position), roughness(recording.control_signal)
    swapped = position > _SMOOTHER * signal
    if np.count_nonzero(swapped) > recording.joints / 2:
        joint = int(np.argmax(swapped)) + 1
        raise IdentificationError(
            f"{recording.name}: the control signal of joint {joint} is far smoother than its position, and a"
            " position is smooth; are position and torque swapped?"
        )


def roughness(values: FloatArray) -> FloatArray:
    """rms of the second differences over that of the signal about its mean, per channel; 0 at rest."""
    spread = values.std(axis=0)
    second = np.sqrt(np.mean(np.diff(values, 2, axis=0) ** 2, axis=0))
    return np.asarray(np.divide(second, spread, out=np.zeros_like(spread), where=spread > 0))


def _check_units(robot: Robot, recording: Recording) -> None:
    """Refuse angles in degrees: far outside the limits, and within them once divided by 57.3."""
    revolute = np.array([joint.kind == "revolute" for joint in robot.joint])
    far = revolute & (_beyond_limits(robot, recording.position) > 1.0)
    if not far.any() or (_beyond_limits(robot, recording.position / _DEGREES) > _BEYOND)[revolute].any():
        return
    joint = int(np.argmax(far))
    reached = float(np.abs(recording.position[:, joint]).max())
    raise IdentificationError(
        f"{recording.name}: joint {joint + 1} reaches {reached:.4g}; allowed: {robot.lower[joint]:g} to"
        f" {robot.upper[joint]:g} rad. Is the position in degrees?"
    )


def _beyond_limits(robot: Robot, position: FloatArray) -> FloatArray:
    """(n,) how far positions leave the limits, as a share of the range; 0 inside."""
    below, above = robot.lower - position.min(axis=0), position.max(axis=0) - robot.upper
    return np.asarray(np.maximum(np.maximum(below, above), 0.0) / (robot.upper - robot.lower))


def _speeds(recording: Recording) -> FloatArray:
    """(n,) speed that is hardly exceeded."""
    steps = np.abs(np.diff(recording.position, axis=0)) / recording.sample_time
    return percentile(steps, _SPEED_PERCENTILE)


def _check_control_signal(recording: Recording) -> None:
    constant = np.ptp(recording.control_signal, axis=0) == 0.0
    if constant.any():
        drive = int(np.argmax(constant))
        raise IdentificationError(
            f"{recording.name}: the control signal of drive {drive + 1} is"
            f" {recording.control_signal[0, drive]:g} throughout; was it recorded?"
        )


def _check_torque(robot: Robot, recording: Recording) -> list[str]:
    """Refuse torques that the arm's drives cannot make: a unit or a gain is wrong. Say where some are odd."""
    torque = percentile(np.abs(robot.joint_torque(recording.control_signal)), _SPEED_PERCENTILE)
    share = torque / robot.torque_limits
    joint = int(np.argmax(share))
    if share[joint] > _TOO_STRONG:
        raise IdentificationError(
            f"{recording.name}: joint {joint + 1}'s torque reaches {torque[joint]:.4g}, {share[joint]:.3g}"
            f" times its limit {robot.torque_limits[joint]:g}; are its unit and gain right?"
        )
    return [
        f"{recording.name}: joint {k + 1}'s torque reaches {torque[k]:.4g}, {share[k]:.3g} times its limit"
        f" {robot.torque_limits[k]:g}; are its unit and gain right?"
        for k in np.flatnonzero(share > _RATHER_STRONG)
    ]


def _too_far_or_fast(robot: Robot, recording: Recording) -> list[str]:
    found = []
    beyond = _beyond_limits(robot, recording.position)
    for joint in np.flatnonzero(beyond > _BEYOND):
        low, high = (float(f(recording.position[:, joint])) for f in (np.min, np.max))
        found.append(
            f"{recording.name}: joint {joint + 1} moves from {low:.4g} to {high:.4g}, beyond its limits"
            f" {robot.lower[joint]:g} to {robot.upper[joint]:g}; are its offset and unit right?"
        )
    speed = _speeds(recording) / robot.velocity_limits
    found += [
        f"{recording.name}: joint {joint + 1} moves at {speed[joint]:.3g} times its velocity limit;"
        " are its unit (degrees?) and the sampling rate right?"
        for joint in np.flatnonzero(speed > _TOO_FAST)
    ]
    return found


def _check_motion(robot: Robot, recordings: tuple[Recording, ...]) -> None:
    """Refuse a joint that no recording moves."""
    travel = np.max([np.ptp(recording.position, axis=0) for recording in recordings], axis=0)
    still = np.flatnonzero(travel < _STANDS_STILL * (robot.upper - robot.lower))
    if still.size:
        named = ", ".join(str(joint + 1) for joint in still)
        stand = f"joint {named} does not move" if still.size == 1 else f"joints {named} do not move"
        joint = int(still[0])
        raise IdentificationError(
            f"{recordings[0].name}: {stand} ({travel[joint]:.2g} {robot.joint[joint].unit} in all), so"
            " inertia and friction cannot be seen; record a motion of every joint"
        )
