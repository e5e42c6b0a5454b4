"""What an arm is about to do, in words for whoever has to allow it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots import Robot
from trajectories import Trajectory

STILL = 1e-6
"""rad or m: a joint that goes no further than this stays where it is."""


@dataclass(frozen=True)
class Leg:
    """One motion of several that follow each other; ``what`` says which."""

    what: str
    trajectory: Trajectory


TO_THE_BEGINNING = "first, slowly, to where the motion begins"


def legs_of(what: str, trajectory: Trajectory, way: Trajectory | None) -> tuple[Leg, ...]:
    """A motion, after the way to where it begins where there is one."""
    first = () if way is None else (Leg(TO_THE_BEGINNING, way),)
    return (*first, Leg(f"then {what}" if first else what, trajectory))


def motion_question(robot: Robot, legs: Sequence[Leg], title: str = "") -> str:
    """Which joints move, how far, how fast and for how long; the last line is the prompt.

    Args:
        robot: the arm.
        legs: in their order.
        title: what this is a part of; empty where it stands alone.
    """
    seconds = sum(leg.trajectory.duration for leg in legs)
    head = f"{title}{robot.name} is going to move for {time_words(seconds)}."
    lines = [head, *(line for leg in legs for line in _leg(robot, leg)), "Go on?"]
    return "\n".join(lines)


def speed_share(robot: Robot, trajectory: Trajectory) -> float:
    """The largest joint speed of a motion, as a share of that joint's limit."""
    return float(_shares(robot, trajectory).max())


def time_words(seconds: float) -> str:
    """A time, to the second above ten of them."""
    if seconds < 10.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def _shares(robot: Robot, trajectory: Trajectory) -> np.ndarray:
    return np.asarray(np.abs(trajectory.velocity).max(axis=0) / robot.velocity_limits)


def _leg(robot: Robot, leg: Leg) -> list[str]:
    trajectory = leg.trajectory
    shares = _shares(robot, trajectory)
    low, high = trajectory.position.min(axis=0), trajectory.position.max(axis=0)
    moving = [axis for axis in range(robot.n) if high[axis] - low[axis] > STILL]
    width = max((len(robot.joint[axis].name) for axis in moving), default=0)
    what = leg.what[:1].upper() + leg.what[1:]
    seconds, fastest = time_words(trajectory.duration), percent(float(shares.max()))
    lines = [f"{what},", f"  for {seconds}, at up to {fastest} of the speed limits:"]
    for axis in moving:
        start, least, most = (
            _place(robot, axis, float(value))
            for value in (trajectory.position[0, axis], low[axis], high[axis])
        )
        lines.append(
            f"  {robot.joint[axis].name:<{width}}  from {start}, between {least} and {most},"
            f" up to {percent(float(shares[axis])):>4}"
        )
    if 0 < len(moving) < robot.n:
        rest = "joints stay" if len(moving) < robot.n - 1 else "joint stays"
        lines.append(f"  The other {rest}.")
    return lines


def _place(robot: Robot, axis: int, value: float) -> str:
    if robot.joint[axis].kind == "revolute":
        return f"{math.degrees(value):7.2f}°"
    return f"{1e3 * value:8.2f} mm"


def percent(share: float) -> str:
    """A share; never rounded down to what it exceeds."""
    return f"{math.ceil(100 * share - 1e-6)} %"
