"""Compliance of the base: a foot that gives way, so that the whole arm rocks under its own moments.

The foot turns about the axes x and y of its base by angles φ that follow from the moment about them,

    (J + I) φ̈ + (D + ∂N/∂φ̇) φ̇ + (1/c + ∂N/∂φ) φ = −N(q, q̇, q̈)

with the inertias J of the foot and I of the arm about the axis, the compliance c, and N the moment that the
motion takes of a base that stands still; of two axes each feels the other as well. (What a turning foot, an
arm in motion and gravity make of each other was a tenth of a foot's torque that rings.) The joints then turn
on a base that leans and is accelerated. It is the slowest oscillation of many cells (pedestals, gantries,
mobile platforms), and each joint alone would be called an elastic gear. Turning about z cannot be told from
an elastic gear of a joint that is upright on it.
"""

from __future__ import annotations

import numpy as np

from ident.effects.chain import chain_frames
from ident.effects.family import Place, PresentModel, Shape
from ident.effects.foot import AXES, FootSpring, inertia_on_foot
from ident.effects.gear_state import Gear
from ident.effects.giving_way import torque_of_giving_way
from ident.effects.placed import Family, Law, Parameters, Parts
from ident.effects.simulated import SimulatedParts
from ident.effects.state import State
from ident.effects.ways import Pliant
from robots import rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot

_DAMPING = 0.05
"""Ratio to critical: bolted steel; from it on it is searched, and models of before have it."""
_RESONANCES = tuple(float(f) for f in np.geomspace(2.5, 30.0, 30))
_SOFTEST, _STIFFEST = 1.5, 60.0
"""Hz, of the described arm in its home posture on its foot; one that rings is missed a tenth beside."""
_OWN, _MOST = 0.5, 4.0
"""Inertia of the foot itself over that of the described arm on it, where it is searched from, and at most."""
_ABOUT = ((0,), (1,), (0, 1))
"""Axes of the foot that give way, by the number that says so."""
_FEWEST_TURNING = 2
"""Joints that turn: of a single axis the moment on its foot is not known."""


def _places(robot: Robot) -> tuple[Place, ...]:
    turning = sum(joint.kind != "prismatic" for joint in robot.joint)
    serial = chain_frames(rigid_body_model(robot)) is not None
    return (Place("base", ()),) if serial and turning >= _FEWEST_TURNING else ()


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    compliance, about, own, ratio = shape
    inertia = inertia_on_foot(robot)
    axes = _ABOUT[int(about)]
    damping = 2.0 * ratio * np.sqrt((inertia + own) / compliance)
    directions = np.eye(AXES + robot.n)
    giving_way = tuple(
        Pliant(directions[axis], Gear(1.0 / compliance, float(damping[axis])), float(inertia[axis]), own)
        for axis in axes
    )

    def law(state: State) -> FloatArray:
        if state.time is None or state.time.shape[0] < 2:
            return np.zeros((*state.position.shape, 1))
        return torque_of_giving_way(giving_way, present, state)[:, :, np.newaxis]

    def parts(values: FloatArray) -> SimulatedParts:
        softer = max(float(values[0]), 0.0) * compliance
        x, y = (softer * (axis in axes) for axis in range(AXES))
        return SimulatedParts(feet=(FootSpring((x, y), (float(damping[0]), float(damping[1])), own),))

    size = (("rocking",), ("1",), ((0.0, 3.0),), (0.1,), (1.0,))
    return Parameters(*size, gives_way=giving_way), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    inertia = float(inertia_on_foot(robot).mean())
    low, *grid, high = (
        1.0 / (inertia * (2.0 * np.pi * f) ** 2) for f in (_STIFFEST, *_RESONANCES[::-1], _SOFTEST)
    )
    return (
        Shape("compliance", "rad/(N·m)", tuple(grid), low, high, True),
        Shape("about", "1", (0.0, 1.0, 2.0), 0.0, 2.0, fixed=True),
        Shape("foot_inertia", "kg·m²", (_OWN * inertia,), 0.0, _MOST * inertia),
        Shape("damping_ratio", "1", (_DAMPING,), 0.005, 0.5, True, usual=_DAMPING),
    )


BASE_COMPLIANCE = Family(
    "base_compliance",
    "a foot that gives way, so that the whole arm rocks",
    "base",
    _places,
    _make,
    _shapes,
    confused_with=("joint_elasticity", "base_tilt", "payload"),
    history=True,
    stiff=True,
    rough=True,
    settled_by="put a dial gauge on the foot and push the arm: a foot that gives way moves with it",
    told_from={
        "joint_elasticity": "put a dial gauge on the foot and push the arm: with an elastic gear it rests",
        "base_tilt": "put a level on the base and move the arm: a tilt stays, a soft foot follows it",
        "payload": "put a dial gauge on the foot and move the arm: with a payload alone it stays still",
    },
    equation=(
        "the foot turns about x of the base (`about` 0), y (1) or both (2), as the moment on it asks"
        " for, with its own `foot_inertia` and a `damping_ratio`; the torque is that of the links on a foot"
        " that leans and is accelerated, less that on one which stands still. The factor of that torque,"
        " `rocking`, is 1 where the shape is right"
    ),
    row=245,
)
