"""The drives' own limits and stop options, compared with the arm's description."""

from __future__ import annotations

from math import pi

import numpy as np

from drivers.frames.job import following_error_window
from drivers.setup.findings import Finding
from drivers.setup.rated_torque import WIDE, compare_torque
from drivers.setup.told_units import Settings
from drivers.setup.units_check import compare_units, velocity_scale
from robots.description import Robot
from robots.windows import demanded_following_error

NEAR = 0.01
"""Relative difference below which two limits are the same."""
UNLIMITED = 0xFFFF_FFFF
LONGEST_FOLLOWING_TIME = 100
"""ms of following error that a drive may watch before it reacts (6066)."""

_STOP_NAMES = {
    "605A": "quick stop",
    "605B": "shutdown",
    "605C": "disable operation",
    "605D": "halt",
    "605E": "fault reaction",
}
_STOP_WORDS = {
    0: "no ramp, the axis coasts",
    1: "slow-down ramp",
    2: "quick-stop ramp",
    3: "at the current limit",
    4: "at the voltage limit",
    5: "slow-down ramp, then hold",
    6: "quick-stop ramp, then hold",
    7: "at the current limit, then hold",
    8: "at the voltage limit, then hold",
}


def compare_limits(robot: Robot, axis: int, settings: Settings) -> list[Finding]:
    """What the drive of an axis allows and how it stops, beside the description.

    Args:
        robot: the description.
        axis: from 0.
        settings: read from the drive.
    """
    return [
        *compare_units(robot, axis, settings),
        *_position(robot, axis, settings),
        *_following(robot, axis, settings),
        *_speed(robot, axis, settings),
        *compare_torque(robot, axis, settings),
        *_stops(settings),
    ]


def _position(robot: Robot, axis: int, settings: Settings) -> list[Finding]:
    low, high = settings.get("607D:01"), settings.get("607D:02")
    if low is None or high is None:
        return [Finding("warning", "607D", "the drive has no software position limits")]
    if low >= high:
        return [Finding("warning", "607D", f"software position limits are off ({low} to {high} counts)")]
    lowest, highest = _counts_range(robot, axis)
    slack = NEAR * (highest - lowest)
    if low > lowest + slack or high < highest - slack:
        words = "narrower: set-points beyond them would be clipped, so a motion that leaves them is refused"
    elif low < lowest - slack or high > highest + slack:
        words = "wider: the drive does not keep the joint inside"
    else:
        return []
    return [
        Finding(
            "warning",
            "607D",
            f"software position limits are {low} to {high} counts, the joint limits {lowest:.0f} to "
            f"{highest:.0f}: {words}",
        )
    ]


def output_range(robot: Robot) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Lowest and highest position of each drive output within the joint limits, 2 × n, rad or m."""
    transmission = robot.transmission_matrix
    forward, backward = np.maximum(transmission, 0.0), np.minimum(transmission, 0.0)
    lowest = forward @ robot.lower + backward @ robot.upper
    highest = forward @ robot.upper + backward @ robot.lower
    return np.stack([lowest, highest])


def _counts_range(robot: Robot, axis: int) -> tuple[float, float]:
    ends = output_range(robot)[:, axis] * robot.counts_per_output_unit[axis]
    return float(ends.min()), float(ends.max())


def _following(robot: Robot, axis: int, settings: Settings) -> list[Finding]:
    window, timeout = settings.get("6065"), settings.get("6066")
    if window is None:
        return [Finding("warning", "6065", "the drive watches no following error; the master does")]
    if window == UNLIMITED:
        return [Finding("warning", "6065", "the drive's following error window is off; the master has one")]
    found = []
    size = abs(float(robot.counts_per_output_unit[axis]))
    own = float(following_error_window(robot, robot.bus.cycle_time)[axis]) * size
    if window > WIDE * own:
        found.append(
            Finding("warning", "6065", f"window of {window} counts; the master stops at {own:.0f} already")
        )
    found += _too_tight(robot, axis, window)
    if timeout is not None and timeout > LONGEST_FOLLOWING_TIME:
        found.append(
            Finding("warning", "6066", f"the drive waits {timeout} ms before it minds a following error")
        )
    return found


def _too_tight(robot: Robot, axis: int, window: int) -> list[Finding]:
    """A window that the loop leaves below the speed limit: the drive would end such motions by itself."""
    fastest = np.abs(robot.transmission_matrix) @ robot.velocity_limits
    size = abs(float(robot.counts_per_output_unit[axis]))
    demanded = float(demanded_following_error(robot, fastest)[axis]) * size
    if demanded <= window:
        return []
    if window == 0:
        text = "window of 0 counts: every motion would be a fault, and is refused; widen 6065 in the drive"
        return [Finding("warning", "6065", text)]
    text = (
        f"window of {window} counts; the loop as described lags {demanded:.0f} at the speed limit: motions "
        f"above {100 * window / demanded:.0f} % of it are refused; widen 6065 in the drive"
    )
    return [Finding("warning", "6065", text)]


def _speed(robot: Robot, axis: int, settings: Settings) -> list[Finding]:
    speed = float((np.abs(robot.transmission_matrix) @ robot.velocity_limits)[axis])
    size = abs(float(robot.counts_per_output_unit[axis]))
    turns = 60 / (2 * pi) if robot.joint[axis].kind == "revolute" else 60.0
    wanted = {
        "607F": (speed * size / velocity_scale(robot, axis, settings), "velocity units"),
        "6080": (speed * robot.drive[axis].gear * turns, "rpm"),
    }
    found = []
    for subject, (needed, unit) in wanted.items():
        value = settings.get(subject)
        if value is None or value == 0:
            continue
        if value < (1 - NEAR) * needed:
            text = f"limits the speed to {value} {unit}; the joint's limit needs {needed:.0f}"
            found.append(Finding("warning", subject, text))
        elif value > WIDE * needed:
            text = f"allows {value} {unit}, {value / needed:.1f} times the joint's limit"
            found.append(Finding("info", subject, text))
    return found


def _stops(settings: Settings) -> list[Finding]:
    found = []
    for subject, name in _STOP_NAMES.items():
        option = settings.get(subject)
        if option is None:
            found.append(Finding("info", subject, f"{name}: the drive does not say how it stops"))
            continue
        words = _STOP_WORDS.get(option, "the maker's own way")
        coasts = option == 0 and subject in ("605A", "605E")
        found.append(Finding("warning" if coasts else "info", subject, f"{name}: {words} ({option})"))
    if settings.get("6085") == 0:
        found.append(Finding("warning", "6085", "quick stop deceleration is 0"))
    return found
