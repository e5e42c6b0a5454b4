"""Figures of a robot.toml that contradict each other: each is possible by itself, together they are a slip.

A description says many things twice: a gear ratio and a speed make a motor speed, a gain and a saturation
make a torque. Where the two disagree by far more than arms do, one of them has lost a digit or a unit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from robots.arrays import FloatArray
from robots.errors import ValueNotAllowed
from robots.windows import LARGEST_WINDOW, loop_error

if TYPE_CHECKING:
    from robots.description import Robot

EARTH = (9.7, 9.9)
"""m/s²; length of the gravity vector, 9.76 to 9.84 on the Earth's surface."""
MOTOR_SPEED = (1.0, 20_000.0)
"""min⁻¹ at the joints' speed limits."""
SATURATION_SHARE = (0.2, 5.0)
"""Torque of a saturated drive, as a share of what the joints' torque limits ask of it."""
LARGEST_FRICTION_SHARE = 0.9
"""Of the torque of a saturated drive: with more friction it would not move."""
LEAST_TORQUE_COUNTS = 50
"""Counts of the control-signal object at saturation."""
SPEED_UP = (1e-3, 100.0)
"""s to the speed limit at the acceleration limit, and to the acceleration limit at the jerk limit."""
LEAST_TRAVEL = 1e-3
"""rad or m."""

Finding = tuple[tuple[str | int, ...], str, str]


def check_plausible(robot: Robot) -> None:
    """Check what only an arm that cannot be would have.

    Raises:
        ValueNotAllowed: the key that contradicts the others, and what would not.
    """
    checks: tuple[Callable[[Robot], Iterator[Finding]], ...] = (_gravity, _joints)
    if robot.has_drives:
        checks += (_motor_speeds, _torques, _windows, _homing)
    with np.errstate(all="ignore"):
        for check in checks:
            for path, problem, allowed in check(robot):
                raise ValueNotAllowed(path, problem, allowed)


def _gravity(robot: Robot) -> Iterator[Finding]:
    length = float(np.linalg.norm(robot.gravity))
    if not EARTH[0] <= length <= EARTH[1]:
        yield ("gravity",), f"has length {length:.4g} m/s²", f"a vector of length {EARTH[0]} to {EARTH[1]}"


def _joints(robot: Robot) -> Iterator[Finding]:
    for i, joint in enumerate(robot.joint):
        travel = joint.position[1] - joint.position[0]
        if travel < LEAST_TRAVEL:
            yield ("joint", i, "position"), f"leaves {travel:g} of travel", f"{LEAST_TRAVEL} and more"
        for key, time in (
            ("acceleration", joint.velocity / joint.acceleration),
            ("jerk", joint.acceleration / joint.jerk),
        ):
            if not SPEED_UP[0] <= time <= SPEED_UP[1]:
                what = "the velocity" if key == "acceleration" else "the acceleration"
                yield (
                    ("joint", i, key),
                    f"reaches {what} limit of {joint.name} in {time:.3g} s",
                    f"{SPEED_UP[0]:g} s to {SPEED_UP[1]:g} s",
                )
        if joint.torque_noise is not None and joint.torque_noise > joint.torque:
            yield ("joint", i, "torque_noise"), "is above the torque limit", f"at most {joint.torque}"


def _motor_speeds(robot: Robot) -> Iterator[Finding]:
    speed = np.abs(robot.transmission_matrix) @ robot.velocity_limits
    for i, (drive, joint) in enumerate(zip(robot.drive, robot.joint, strict=True)):
        turns = speed[i] * drive.gear * (60 / (2 * np.pi) if joint.kind == "revolute" else 60.0)
        if not MOTOR_SPEED[0] <= turns <= MOTOR_SPEED[1]:
            yield (
                ("drive", i, "gear"),
                f"makes a motor speed of {turns:.3g} min⁻¹ at the velocity limits",
                f"{MOTOR_SPEED[0]:g} to {MOTOR_SPEED[1]:g} min⁻¹ there",
            )


def _torques(robot: Robot) -> Iterator[Finding]:
    wanted = np.abs(np.linalg.inv(robot.transmission_matrix).T) @ robot.torque_limits
    saturated = np.array(robot.controller.saturation) * robot.gains
    for i, drive in enumerate(robot.drive):
        yield from _saturation(robot, i, float(saturated[i]), float(wanted[i]))
        counts = robot.controller.saturation[i] / drive.control_signal.per_count
        if counts < LEAST_TORQUE_COUNTS:
            yield (
                ("drive", i, "control_signal", "per_count"),
                f"makes {counts:.3g} counts at controller.saturation",
                f"at least {LEAST_TORQUE_COUNTS} counts there",
            )
        if drive.dynamics.coulomb > LARGEST_FRICTION_SHARE * saturated[i]:
            yield (
                ("drive", i, "dynamics", "coulomb"),
                f"is more than the drive can overcome with {saturated[i]:.4g} at its saturation",
                f"at most {LARGEST_FRICTION_SHARE * saturated[i]:.4g}",
            )
        yield from _at_the_limits(robot, i, float(saturated[i]))


def _saturation(robot: Robot, i: int, saturated: float, wanted: float) -> Iterator[Finding]:
    low, high = SATURATION_SHARE
    if not low * wanted <= saturated <= high * wanted:
        yield (
            ("drive", i, "gain"),
            f"times controller.saturation is {saturated:.4g} {robot.joint[i].torque_unit}; the"
            f" joints' torque limits ask for {wanted:.4g}",
            f"{low:g} to {high:g} times that",
        )


def _at_the_limits(robot: Robot, i: int, saturated: float) -> Iterator[Finding]:
    """What inertia and viscous friction take of a drive at the joints' limits."""
    size = np.abs(robot.transmission_matrix[i])
    dynamics = robot.drive[i].dynamics
    for key, torque in (
        ("inertia", dynamics.inertia * float(size @ robot.acceleration_limits)),
        ("viscous", dynamics.viscous * float(size @ robot.velocity_limits)),
    ):
        most = SATURATION_SHARE[1] * saturated
        if torque > most:
            yield (
                ("drive", i, "dynamics", key),
                f"takes {torque:.4g} {robot.joint[i].torque_unit} at the joints' limits;"
                f" the drive has {saturated:.4g}",
                f"up to {SATURATION_SHARE[1]:g} times that",
            )


def _windows(robot: Robot) -> Iterator[Finding]:
    errors: FloatArray = loop_error(robot, robot.bus.cycle_time)
    for i, (joint, error) in enumerate(zip(robot.joint, errors, strict=True)):
        most = LARGEST_WINDOW[joint.kind]
        if not error <= most:
            yield (
                ("controller", "position_gain", i),
                f"with velocity_gain, velocity_feed_forward and saturation lets the drive be"
                f" {error:.3g} {joint.unit} from its set-point before it is at its limit",
                f"gains, speed limits or a bus.cycle_time that make at most {most:g} of it",
            )


def _homing(robot: Robot) -> Iterator[Finding]:
    for i, drive in enumerate(robot.drive):
        if drive.homing is None:
            continue
        size = np.abs(robot.transmission_matrix[i])
        reach = float(size @ (robot.upper - robot.lower))
        if drive.homing.travel > 2 * reach:
            yield (
                ("drive", i, "homing", "travel"),
                f"is more than twice the travel of the joints, {reach:.4g}",
                f"at most {2 * reach:.4g}",
            )
