"""Stiffening elasticity: a gear that gives way, and the less the more it is bent.

Strain-wave gears stiffen with load as more teeth touch: K x + C x³ (Tuttle and Seering, A nonlinear model of
a harmonic drive gear transmission, 1996; makers give stiffnesses for small, middling and large torques).
"""

from __future__ import annotations

import numpy as np

from ident.effects.elastic_gear import behind_gear, gear_columns, link_inertia
from ident.effects.family import Place, PresentModel, Shape
from ident.effects.gear_state import Gear
from ident.effects.placed import Family, Law, Parameters, Parts, angle_unit, each_drive, torque_unit
from ident.effects.scales import rated_torque
from ident.effects.simulated import GearSpring, SimulatedParts
from robots.arrays import FloatArray
from robots.description import Robot

_FREQUENCIES = (7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0)
"""Hz, of the links on the gear as soft as it is at rest. One of 50 Hz made three noise floors, and was a play
or a soft gear while the stiffest had 20."""
_LOAD = 0.1
"""Of the rated torque: the way by which it would bend a gear of the first stiffness makes the further one
``stiffening`` times that."""
_DAMPING = 0.08
"""Ratio to critical at rest: from it on it is searched, as that of any gear that gives way, and models of
before have it. (At it two gears with 0.03 had 42 and 59 % of what is theirs, and one was not confirmed.)"""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, (compliance, stiffening, ratio) = place.joints[0], shape
    damping = 2.0 * ratio * float(np.sqrt(link_inertia(robot, drive) / compliance))
    cubic = stiffening / compliance / (compliance * _LOAD * rated_torque(robot, place)) ** 2
    behind = behind_gear(robot, drive, Gear(1.0 / compliance, damping, cubic=cubic))
    law = gear_columns(robot, drive, present, behind)

    def parts(values: FloatArray) -> SimulatedParts:
        softer = compliance * float(values[0])
        return SimulatedParts(springs=(GearSpring(drive, softer, damping, cubic=cubic),))

    size = (("stiffening_gear",), ("1",), ((0.0, 3.0),), (0.1,), (1.0,))
    return Parameters(*size, gives_way=(behind,)), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    inertia = link_inertia(robot, place.joints[0])
    low, *grid, high = (1.0 / (inertia * (2 * np.pi * f) ** 2) for f in (120.0, *_FREQUENCIES[::-1], 3.0))
    unit = f"{angle_unit(robot, place)}/({torque_unit(robot, place)})"
    return (
        Shape("compliance", unit, tuple(map(float, grid)), float(low), float(high), True),
        Shape("stiffening", "1", (1.0,), 0.02, 50.0, True),
        Shape("damping_ratio", "1", (_DAMPING,), 0.002, 1.0, True, usual=_DAMPING),
    )


STIFFENING_ELASTICITY = Family(
    "stiffening_elasticity",
    "a gear that gives way, the less the more it is bent",
    "drive",
    each_drive,
    _make,
    _shapes,
    contains=("joint_elasticity",),
    confused_with=("joint_elasticity", "backlash"),
    shows="both",
    stiff=True,
    rough=True,
    history=True,
    settled_by=(
        "lock the motor and hang growing weights on the link, a dial gauge on it: the way grows ever less"
    ),
    told_from={
        "joint_elasticity": (
            "lock the motor and hang growing weights on the link, a dial gauge on it: a gear that stiffens"
            " moves ever less"
        ),
    },
    timeless=True,
    equation=(
        "as `joint_elasticity`, through a spring of K·x + C·x³ with K = 1/compliance; where a tenth of the "
        "rated torque would bend it by K alone, C·x² is `stiffening` times K"
    ),
    row=115,
)
