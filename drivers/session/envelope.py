"""The set-point envelope: every cycle of a reference within the joints' limits, before anything moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.errors import DriveError
from drivers.setup.drive import DriveReport
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

RELATIVE_TOLERANCE = 1e-6
"""For rounding; differences of a feasible reference are means of its derivatives and so within them."""


def check_envelope(robot: Robot, reference: FloatArray, cycle_time: float) -> None:
    """Refuse a reference that leaves a limit at any cycle, or does not begin and end at rest.

    Velocity and acceleration are first and second differences of what the drives will be given, with
    the first and the last position held before and after.

    Args:
        robot: whose limits hold.
        reference: N × n joint positions, rad or m.
        cycle_time: s.

    Raises:
        DriveError: joint, cycle, value and limit of the first violation.
    """
    if reference.ndim != 2 or reference.shape[1] != robot.n or not len(reference):
        raise DriveError(f"reference has shape {reference.shape}; allowed: N × {robot.n} with N ≥ 1")
    if not np.isfinite(reference).all():
        cycle, joint = np.argwhere(~np.isfinite(reference))[0]
        raise DriveError(f"reference of joint {robot.joint[joint].name} is not finite at cycle {cycle}")
    held = np.vstack([reference[:1], reference[:1], reference, reference[-1:], reference[-1:]])
    velocity = np.diff(held, axis=0) / cycle_time
    acceleration = np.diff(velocity, axis=0) / cycle_time
    span = RELATIVE_TOLERANCE * (robot.upper - robot.lower)
    above = reference - robot.upper
    below = robot.lower - reference
    _refuse(robot, "position", reference, (above > span) | (below > span), robot.upper, robot.lower)
    for word, row in (("begin", acceleration[1]), ("end", acceleration[-2])):
        if (outside := np.abs(row) > robot.acceleration_limits * (1 + RELATIVE_TOLERANCE)).any():
            name = robot.joint[int(np.argmax(outside))].name
            raise DriveError(f"reference of joint {name} does not {word} at rest")
    rows = slice(1, 1 + len(reference))
    for quantity, values, limit in (
        ("velocity", velocity[rows], robot.velocity_limits),
        ("acceleration", acceleration[rows], robot.acceleration_limits),
    ):
        _refuse(robot, quantity, values, np.abs(values) > limit * (1 + RELATIVE_TOLERANCE), limit, -limit)


def check_start(robot: Robot, actual: FloatArray, first: FloatArray, tolerance: float) -> None:
    """Refuse a reference that begins elsewhere than where the arm stands.

    Args:
        robot: names of the joints.
        actual: (n,) where it stands, rad or m.
        first: (n,) of the reference.
        tolerance: rad or m.

    Raises:
        DriveError: the joint that is farthest off.
    """
    distance = np.abs(actual - first)
    if (distance > tolerance).any():
        axis = int(np.argmax(distance))
        raise DriveError(
            f"joint {robot.joint[axis].name} stands at {actual[axis]:.6g} but the reference begins "
            f"at {first[axis]:.6g}; allowed: {tolerance:g} apart"
        )


def check_drive_limits(robot: Robot, counts: NDArray[np.int32], reports: Sequence[DriveReport]) -> None:
    """Refuse set-points that a drive would clip at its own software limits (607Dh).

    Args:
        robot: names of the joints.
        counts: N × n set-points.
        reports: what the drives' limits are.

    Raises:
        DriveError: drive, value and limits of the first one.
    """
    for axis, report in enumerate(reports):
        low, high = report.settings.get("607D:01"), report.settings.get("607D:02")
        if low is None or high is None or low >= high:
            continue
        least, most = int(counts[:, axis].min()), int(counts[:, axis].max())
        if least < low or most > high:
            raise DriveError(
                f"reference of drive {axis + 1} ({robot.joint[axis].name}) goes from {least} to {most}, "
                f"its own limits (607D) are {low} to {high}"
            )


def checked_period_ends(rows: Sequence[int], length: int) -> tuple[int, ...]:
    """Rows at which periods end, in order.

    Raises:
        DriveError: a row is not inside the reference.
    """
    for row in rows:
        if not 1 <= row < length:
            raise DriveError(f"a period cannot end at row {row}; allowed: 1 to {length - 1}")
    return tuple(sorted(set(rows)))


def _refuse(
    robot: Robot,
    quantity: str,
    values: FloatArray,
    outside: BoolArray,
    upper: FloatArray,
    lower: FloatArray,
) -> None:
    if not outside.any():
        return
    cycle, joint = (int(i) for i in np.argwhere(outside)[0])
    raise DriveError(
        f"reference of joint {robot.joint[joint].name} leaves its {quantity} limit at cycle {cycle}: "
        f"{values[cycle, joint]:.6g}; allowed: {lower[joint]:.6g} to {upper[joint]:.6g}"
    )
