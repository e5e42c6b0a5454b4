"""Springs between links and their surroundings: gravity compensation, cable or dress pack, a contact."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    ANY,
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    angle_unit,
    each_joint,
    joint_row,
    torque_unit,
)
from ident.effects.scales import rated_torque, way
from ident.effects.simulated import PositionTorque, SimulatedParts, Table
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

Curves = tuple[Callable[[FloatArray], FloatArray], ...]

_ANCHORS = np.arange(-3, 5) / 4.0
"""Of π: where the search for the angle of two anchors begins."""

_SPRING, _CABLE, _STIFFENED, _CONTACT = 0.1, 0.03, 0.1, 0.3
"""Deviations of what springs pull with at the end of the way (:func:`ident.effects.scales.way`), of the
rated torque."""

_RESTS, _REST_ENDS = np.linspace(0.1, 0.9, 17), np.array([0.05, 0.95])
"""Of the travel: closer than a contact's; a cable with a wrong rest pulls where it should hang free."""

_CORNERS = np.arange(4, 197) / 200
"""Of the travel: where something may begin."""

_MARGIN = 0.2
"""rad (or m) beyond the joint's limits that the simulation's table reaches."""


def _over_position(robot: Robot, place: Place, curves: Curves) -> tuple[Law, Parts]:
    """Columns and simulation of torques over one joint's position."""
    row, joint = joint_row(robot, place), place.joints[0]
    lower, upper = float(robot.lower[joint]) - _MARGIN, float(robot.upper[joint]) + _MARGIN

    def law(state: State) -> FloatArray:
        return along(row, *(curve(state.position[:, joint]) for curve in curves))

    def parts(values: FloatArray) -> SimulatedParts:
        def whole(position: FloatArray) -> FloatArray:
            return np.asarray(sum(v * curve(position) for v, curve in zip(values, curves, strict=True)))

        return SimulatedParts(position=(PositionTorque(row, row, Table.of(whole, lower, upper)),))

    return law, parts


def _gravity_spring(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A torsion spring: stiffness, and the torque at position zero, which stands for the rest angle."""
    law, parts = _over_position(robot, place, (lambda q: q, np.ones_like))
    torque = torque_unit(robot, place)
    symbols = ("stiffness", "preload")
    units = (f"{torque}/{angle_unit(robot, place)}", torque)
    size = _SPRING * rated_torque(robot, place)
    return Parameters(symbols, units, (POSITIVE, ANY), (size / way(robot, place), size)), law, parts


def _anchored_spring(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A spring between an anchor on each side of the joint, in line at an angle: k (L − L₀) dL/dq.

    With radii a and b of the fixed and the moving anchor L² = a² + b² − 2ab cos(q − angle); the parameter is
    k a b, and the lengths are relative to a.
    """
    angle, radius, free = shape

    def pull(position: FloatArray) -> FloatArray:
        turned = position - angle
        length = np.sqrt(1.0 + radius**2 - 2.0 * radius * np.cos(turned))
        return np.asarray(np.sin(turned) * (1.0 - free / length))

    law, parts = _over_position(robot, place, (pull,))
    unit, scale = torque_unit(robot, place), (_SPRING * rated_torque(robot, place),)
    return Parameters(("spring",), (unit,), (POSITIVE,), scale), law, parts


def _revolute(robot: Robot) -> tuple[Place, ...]:
    return tuple(place for place in each_joint(robot) if robot.joint[place.joints[0]].kind == "revolute")


def _anchor_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (
        Shape("anchor_angle", "rad", tuple(float(a) for a in np.pi * _ANCHORS), -1.1 * np.pi, 1.1 * np.pi),
        Shape("moving_radius", "1", (0.4,), 0.05, 0.95),
        Shape("free_length", "1", (0.5,), 0.0, 1.5),
    )


def _cable_spring(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A cable or dress pack that stiffens away from where it hangs free."""
    (rest,) = shape
    law, parts = _over_position(robot, place, (lambda q: q - rest, lambda q: (q - rest) ** 3))
    torque, angle = torque_unit(robot, place), angle_unit(robot, place)
    symbols = ("cable", "stiffening")
    # Not at the end of the travel: it may hang free of half a turn, and be as hard where the arm moves.
    torque_there, bent = rated_torque(robot, place), way(robot, place)
    scale = (_CABLE * torque_there / bent, _STIFFENED * torque_there / bent**3)
    return (
        Parameters(symbols, (f"{torque}/{angle}", f"{torque}/{angle}³"), (POSITIVE, POSITIVE), scale),
        law,
        parts,
    )


def _contact(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A spring that acts beyond an angle on one side of it."""
    angle, side = shape

    def pressed(position: FloatArray) -> FloatArray:
        return side * np.maximum(side * (position - angle), 0.0)

    law, parts = _over_position(robot, place, (pressed,))
    unit = f"{torque_unit(robot, place)}/{angle_unit(robot, place)}"
    scale = (_CONTACT * rated_torque(robot, place) / way(robot, place),)
    return Parameters(("contact",), (unit,), (POSITIVE,), scale), law, parts


def _within_limits(robot: Robot, place: Place, shares: FloatArray) -> tuple[float, ...]:
    joint = place.joints[0]
    lower, upper = float(robot.lower[joint]), float(robot.upper[joint])
    return tuple((lower + shares * (upper - lower)).tolist())


def _rest_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    low, high = _within_limits(robot, place, _REST_ENDS)
    grid = _within_limits(robot, place, _RESTS)
    return (Shape("rest_angle", angle_unit(robot, place), grid, low, high),)


def _contact_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    grid = _within_limits(robot, place, _CORNERS)
    return (
        Shape("contact_angle", angle_unit(robot, place), grid, grid[0], grid[-1], scanned="corner"),
        Shape("side", "1", (-1.0, 1.0), -1.0, 1.0, fixed=True),
    )


ANCHORED_SPRING = Family(
    "gravity_spring",
    "a spring between an anchor on each side of the joint, as for gravity compensation",
    "joint",
    _revolute,
    _anchored_spring,
    _anchor_shapes,
    essential=(0,),
    contains=("current_offset",),
    confused_with=("contact", "cable_spring", "base_tilt"),
)
GRAVITY_SPRING = Family(
    "gravity_spring",
    "a spring about the joint, as for gravity compensation",
    "joint",
    each_joint,
    _gravity_spring,
    essential=(0,),
    contains=("current_offset",),
    confused_with=("contact", "cable_spring", "base_tilt"),
    forms=(ANCHORED_SPRING,),
    settled_by="unhook the spring, with the arm held, and record again: its torque is gone",
    equation=(
        "stiffness·q + preload; the rest angle is −preload/stiffness. Between an anchor on each "
        "side of the joint, in line at anchor_angle, it is spring·sin(q − anchor_angle)·(1 − "
        "free_length/length) with length² = 1 + moving_radius² − 2·moving_radius·cos(q − "
        "anchor_angle), all lengths relative to the fixed anchor's radius"
    ),
    row=230,
)
CABLE_SPRING = Family(
    "cable_spring",
    "a cable or dress pack that pulls the joint back and stiffens",
    "joint",
    each_joint,
    _cable_spring,
    _rest_shapes,
    essential=(1,),
    contains=("gravity_spring",),
    confused_with=("gravity_spring", "contact"),
    settled_by="take the dress pack off and record again: a cable is gone",
    told_from={
        "gravity_spring": "take the dress pack off and record again: a cable is gone, a spring is not",
        "contact": "take the dress pack off and record again: a cable is gone, a contact is not",
    },
    equation="cable·(q − rest_angle) + stiffening·(q − rest_angle)³",
    row=260,
)
CONTACT = Family(
    "contact",
    "something that the joint presses against beyond an angle",
    "joint",
    each_joint,
    _contact,
    _contact_shapes,
    confused_with=("gravity_spring", "cable_spring"),
    shows="both",
    settled_by="clear the surroundings of the arm and record again: a contact is gone",
    told_from={
        "gravity_spring": (
            "clear the surroundings of the arm and record again: a contact is gone, a spring is not"
        ),
    },
    equation="pushes back from contact_angle on, on the side that `side` says",
    row=270,
)
