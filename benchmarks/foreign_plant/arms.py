"""Three arms: kinematics, links, drives and limits.

Every joint turns about the z axis of its own frame, which stands at ``origin`` in the frame of the joint
before, turned by roll, pitch and yaw (as in a URDF). Figures are at the joint, SI; made up after published
arms of these sizes.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

_TURNS = {"+": pi / 2, "-": -pi / 2}
"""Quarter turns in the tables."""


@dataclass(frozen=True)
class Link:
    """One joint and the link behind it.

    Attributes:
        origin, rpy: of the joint's frame in the one before, m and rad.
        mass: kg.
        centre: of mass in the joint's frame, m.
        inertia: about the centre, along the frame's axes: xx yy zz, kg·m².
        rotor: inertia, kg·m².
        viscous, coulomb: friction, N·m·s/rad and N·m.
        gain: N·m per unit of control signal.
        torque, speed: limits, N·m and rad/s.
        travel: rad, lower and upper.
    """

    origin: tuple[float, float, float]
    rpy: tuple[float, float, float]
    mass: float
    centre: tuple[float, float, float]
    inertia: tuple[float, float, float]
    rotor: float
    viscous: float
    coulomb: float
    gain: float
    torque: float
    speed: float
    travel: tuple[float, float]


@dataclass(frozen=True)
class Arm:
    """An arm.

    Attributes:
        name: of it.
        links: from the base on.
        bandwidth: Hz, of the velocity loops, one per joint.
        swing: largest share of the travel that a motion uses.
    """

    name: str
    links: tuple[Link, ...]
    bandwidth: tuple[float, ...]
    swing: float

    @property
    def n(self) -> int:
        return len(self.links)


def _number(word: str) -> float:
    return _TURNS[word] if word in _TURNS else float(word)


def _links(table: str) -> tuple[Link, ...]:
    """A link a line, in the order of ``Link``: origin, rpy, mass, centre, inertia, drive, limits, travel."""
    links = []
    for line in table.strip().splitlines():
        parts = [tuple(_number(word) for word in part.split()) for part in line.split("|")]
        origin, rpy, (mass,), centre, inertia, (rotor, viscous, coulomb), (gain, torque, speed), travel = (
            parts
        )
        links.append(
            Link(origin, rpy, mass, centre, inertia, rotor, viscous, coulomb, gain, torque, speed, travel)  # type: ignore[arg-type]
        )
    return tuple(links)


COMPACT = Arm(
    "compact6",
    _links(
        """
0 0 0.34 | 0 0 0 | 9.2 | 0 0 -0.05 | 0.07 0.065 0.04 | 0.4 7 6.5 | 33 130 5 | -2.9 2.9
0 0 0 | - - 0 | 5.4 | 0.09 -0.002 0.04 | 0.018 0.06 0.055 | 0.55 6.1 7.4 | 31 130 5 | -2 2
0.24 0 0.03 | 0 0 + | 4.3 | 0.009 0.006 0.06 | 0.035 0.033 0.015 | 0.09 2.2 5.8 | 23 100 7 | -2.3 2.3
0 -0.24 0 | + 0 0 | 3.4 | 0.004 -0.002 -0.15 | 0.043 0.041 0.009 | 0.036 1.2 2.6 | 9.5 46 7 | -3 3
0 0 0 | - 0 0 | 1.1 | 0 -0.003 -0.001 | 0.0018 0.0014 0.0013 | 0.034 1.4 3.1 | 14 46 5.5 | -1.9 1.9
0 0 0 | + 0 0 | 0.35 | 0.004 0 0.05 | 0.0009 0.0008 0.0004 | 0.012 0.7 1.7 | 6.8 20 10 | -3 3
"""
    ),
    (24, 24, 24, 35, 35, 40),
    0.30,
)
"""Of the size of a TX40, with rigid drives that each move one joint."""

HEAVY = Arm(
    "heavy6",
    _links(
        """
0 0 0.52 | 0 0 0 | 95 | 0.12 -0.03 -0.08 | 3.1 3.6 3.9 | 38 110 95 | 310 2600 2.6 | -2.8 2.8
0.35 0 0 | - 0 0 | 82 | 0.46 0.02 0.11 | 0.9 6.4 6.1 | 55 140 120 | 390 3400 2.4 | -1.9 0.9
0.87 0 0 | 0 0 - | 61 | 0.06 -0.12 0.05 | 2.6 0.9 2.7 | 24 70 80 | 260 1700 2.7 | -1.6 1.6
0.17 0.62 0 | - 0 0 | 24 | 0 0.01 0.24 | 0.72 0.7 0.12 | 2.9 9.5 14 | 62 420 5.1 | -3 3
0 0 0.48 | + 0 0 | 11 | 0 -0.05 0.01 | 0.09 0.05 0.08 | 2.3 7.6 12 | 55 390 5.4 | -1.9 1.9
0 0 0 | - 0 0 | 7.5 | 0.03 0.01 0.17 | 0.06 0.07 0.05 | 0.95 3.2 7.5 | 34 230 7.2 | -3 3
"""
    ),
    (14, 14, 14, 22, 22, 24),
    0.30,
)
"""A heavy arm with offset shoulder and long forearm: torques of hundreds of N·m, half the bandwidth."""

SEVEN = Arm(
    "seven",
    _links(
        """
0 0 0.33 | 0 0 0 | 4.4 | 0.003 0.02 -0.09 | 0.03 0.028 0.012 | 0.55 5.2 2.9 | 12 95 2.1 | -2.7 2.7
0 0 0 | - 0 0 | 4.1 | -0.002 -0.11 0.03 | 0.04 0.011 0.038 | 0.55 5 3.1 | 12 95 2.1 | -1.7 1.7
0 -0.32 0 | + 0 0 | 3.1 | 0.03 0.02 -0.06 | 0.019 0.018 0.009 | 0.32 3.1 1.9 | 9 80 2.1 | -2.7 2.7
0.085 0 0 | + 0 0 | 2.9 | -0.04 0.09 0.02 | 0.025 0.009 0.024 | 0.32 2.9 2 | 9 80 2.1 | -2.9 -0.1
-0.085 0.38 0 | - 0 0 | 2.6 | -0.01 0.05 -0.11 | 0.027 0.025 0.006 | 0.11 1.1 1.2 | 4.1 30 2.6 | -2.7 2.7
0 0 0 | + 0 0 | 1.6 | 0.06 -0.02 0.01 | 0.004 0.006 0.007 | 0.11 1 1.1 | 4.1 30 2.6 | 0.1 3.4
0.088 0 0 | + 0 0 | 0.9 | 0.01 0.01 0.08 | 0.003 0.003 0.0015 | 0.075 0.7 0.8 | 3.4 25 2.6 | -2.7 2.7
"""
    ),
    (18, 18, 18, 18, 24, 24, 24),
    0.32,
)
"""Seven axes of little friction with strain-wave gears' large rotor inertias, slow and of low gain."""

ARMS = {arm.name: arm for arm in (COMPACT, HEAVY, SEVEN)}
