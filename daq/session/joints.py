"""One joint and how far it shall go, as people say it: number or name; rad, m, degrees or millimetres."""

from __future__ import annotations

import math

from daq.session.session_error import SessionError
from robots import Robot

_UNITS = {"revolute": {"rad": 1.0, "deg": math.pi / 180}, "prismatic": {"m": 1.0, "mm": 1e-3}}
"""Per kind of joint, the first one where none is given."""


def joint_index(robot: Robot, text: str) -> int:
    """The joint of a number (from 1) or a name, counted from 0.

    Raises:
        SessionError: there is none.
    """
    names = [joint.name for joint in robot.joint]
    if text in names:
        return names.index(text)
    if text.isdecimal() and 1 <= int(text) <= robot.n:
        return int(text) - 1
    raise SessionError(f"--joint {text}; allowed: 1 to {robot.n}, {', '.join(names)}")


def distance_of(robot: Robot, axis: int, text: str) -> float:
    """A signed way of a joint, rad or m.

    Args:
        robot: the arm.
        axis: which joint, from 0.
        text: a number, with a unit behind it or without: ``0.05``, ``-3deg``, ``2mm``.

    Raises:
        SessionError: it is no number other than 0, or in a unit that the joint does not have.
    """
    units = _UNITS[robot.joint[axis].kind]
    number, unit = text.strip(), next(iter(units))
    # The longest first: "mm" ends in "m", too.
    for name in sorted(units, key=len, reverse=True):
        if number.endswith(name):
            number, unit = number.removesuffix(name), name
            break
    try:
        distance = float(number) * units[unit]
    except ValueError:
        distance = math.nan
    if not math.isfinite(distance) or distance == 0.0:
        raise SessionError(
            f"--by {text}; allowed: a number other than 0 in {' or '.join(units)}, such as -3{[*units][1]}"
        )
    return distance


def shown(robot: Robot, axis: int, value: float) -> str:
    """A position or a way of a joint, for people."""
    if robot.joint[axis].kind == "revolute":
        radians, degrees = round(value, 4) + 0.0, round(math.degrees(value), 2) + 0.0  # no minus zero
        return f"{radians:.4f} rad ({degrees:.2f}°)"
    return f"{value:.5f} m"
