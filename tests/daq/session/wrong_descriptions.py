"""Forty ways to describe an arm wrongly, single and in pairs, and the guards that they meet before torque."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from drivers.setup.limits import compare_limits
from drivers.setup.rated_torque import doubtful_gain
from drivers.simulated.truth import draw_truth
from robots import Robot
from robots.errors import ValueNotAllowed
from robots.plausibility import check_plausible
from tests.daq.session.wrong_arms import WrongArm

Slip = tuple[str, Callable[[WrongArm], WrongArm]]
ATTESTED = 0.02
"""rad or m; a posture that somebody reads off the arm must be within it (drivers.setup.attestation)."""
GEARS, MOTORS = (0.6, 0.95), (0.9, 1.1)
"""Share of its motor's torque that a gear passes on, and of its name plate that a motor gives."""


def right_arm(robot: Robot, seed: int) -> WrongArm:
    """An arm that is as described, at a posture of its own."""
    generator = np.random.default_rng(seed)
    middle = (robot.lower + robot.upper) / 2
    home = np.array(robot.home)
    posture = home + 0.4 * generator.uniform(-1.0, 1.0, robot.n) * np.minimum(1.0, robot.upper - middle)
    n = robot.n
    torque = np.array([1e6 * one.gain * one.control_signal.per_count / one.gear for one in robot.drive])
    passed_on = generator.uniform(*GEARS, n) * generator.uniform(*MOTORS, n)
    rated = np.rint(torque / passed_on)
    return WrongArm(robot, robot, draw_truth(robot, seed), posture, tuple(range(n)), np.zeros(n), rated)


def drive(k: int, key: str, factor: float) -> Callable[[WrongArm], WrongArm]:
    """One figure of a drive times a factor."""

    def change(arm: WrongArm) -> WrongArm:
        drives = list(arm.wrong.drive)
        value = getattr(drives[k], key)
        drives[k] = drives[k].model_copy(update={key: type(value)(value * factor)})
        return replace(arm, wrong=arm.wrong.model_copy(update={"drive": tuple(drives)}))

    return change


def torque_sign(k: int) -> Callable[[WrongArm], WrongArm]:
    """The other sign of a drive's control signal alone."""

    def change(arm: WrongArm) -> WrongArm:
        drives = list(arm.wrong.drive)
        turned = -(drives[k].control_signal.sign or drives[k].sign)
        signal = drives[k].control_signal.model_copy(update={"sign": turned})
        drives[k] = drives[k].model_copy(update={"control_signal": signal})
        return replace(arm, wrong=arm.wrong.model_copy(update={"drive": tuple(drives)}))

    return change


def position_sign(k: int) -> Callable[[WrongArm], WrongArm]:
    """The other sign of a drive's positions alone: its torque is read as before."""
    return lambda arm: torque_sign(k)(drive(k, "sign", -1)(arm))


def per_count(k: int, factor: float) -> Callable[[WrongArm], WrongArm]:
    def change(arm: WrongArm) -> WrongArm:
        drives = list(arm.wrong.drive)
        signal = drives[k].control_signal
        other = signal.model_copy(update={"per_count": signal.per_count * factor})
        drives[k] = drives[k].model_copy(update={"control_signal": other})
        return replace(arm, wrong=arm.wrong.model_copy(update={"drive": tuple(drives)}))

    return change


def swapped(i: int, j: int) -> Callable[[WrongArm], WrongArm]:
    def change(arm: WrongArm) -> WrongArm:
        order = list(arm.order)
        order[i], order[j] = order[j], order[i]
        return replace(arm, order=tuple(order))

    return change


def shifted(k: int, by: float) -> Callable[[WrongArm], WrongArm]:
    """The encoder's zero is elsewhere, rad or m at the drive output."""

    def change(arm: WrongArm) -> WrongArm:
        zero = arm.zero.copy()
        zero[k] += round(by * arm.true.counts_per_output_unit[k])
        return replace(arm, zero=zero)

    return change


SINGLE: tuple[Slip, ...] = (
    *((f"sign of drive {k + 1}", drive(k, "sign", -1)) for k in range(6)),
    *((f"control_signal.sign of drive {k + 1}", torque_sign(k)) for k in range(6)),
    *(
        (f"encoder of drive {k + 1} x {f}", drive(k, "encoder_counts", f))
        for k, f in ((0, 10), (2, 0.1), (5, 4))
    ),
    *(
        (f"gear of drive {k + 1} x {f}", drive(k, "gear", f))
        for k, f in ((0, 10), (1, 3), (3, 0.1), (4, 57), (5, 2))
    ),
    *(
        (f"gain of drive {k + 1} x {f}", drive(k, "gain", f))
        for k, f in ((0, 10), (1, 0.25), (2, 3.5), (5, 0.25))
    ),
    *((f"per_count of drive {k + 1} x {f}", per_count(k, f)) for k, f in ((0, 10), (2, 0.1), (4, 2))),
    *(
        (f"nodes {i + 1} and {j + 1} swapped", swapped(i, j))
        for i, j in ((0, 1), (1, 2), (2, 4), (4, 5), (0, 5))
    ),
    *(
        (f"zero of drive {k + 1} off by {f}", shifted(k, f))
        for k, f in ((1, 1.2), (2, -0.8), (0, 0.5), (4, 0.3))
    ),
)


def pairs(count: int) -> tuple[Slip, ...]:
    """Two of the slips at once, with a fixed seed."""
    generator = random.Random("pairs")
    found: list[Slip] = []
    while len(found) < count:
        (one, first), (other, second) = generator.sample(SINGLE, 2)
        if one.split(" x ")[0] != other.split(" x ")[0]:
            found.append((f"{one}, {other}", lambda arm, a=first, b=second: b(a(arm))))
    return tuple(found)


def before_torque(arm: WrongArm) -> str:
    """The guard that refuses a description before any drive has torque, or nothing."""
    try:
        check_plausible(arm.wrong)
    except ValueNotAllowed:
        return "by its own figures"
    for k, real in enumerate(arm.order):
        settings = {
            "608F:01": arm.true.drive[real].encoder_counts,
            "608F:02": 1,
            "6076": int(arm.rated[real]),
        }
        if any(found.severity == "refusal" for found in compare_limits(arm.wrong, k, settings)):
            return "by the drive's encoder (608F)"
        if doubtful_gain(arm.wrong, k, settings) is not None:
            return "by the drive's rated torque (6076)"
    if (np.abs(arm.reading() - arm.posture) > ATTESTED).any():
        return "by attestation"
    return ""
