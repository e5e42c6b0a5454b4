"""The usual model's own effects as families, one drive at a time: for models that lack one of them.

In a model that has them they explain nothing more, unless a prior holds their parameters.
"""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    angle_unit,
    drive_row,
    each_drive,
    torque_unit,
)
from ident.effects.scales import dry_friction, rotor_inertia, viscous_friction
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.speed_term import FrictionSign
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

SYMBOLS = {
    "coulomb_friction": ("Fc", "Fcp", "Fcm"),
    "viscous_friction": ("Fv", "Fvp"),
    "rotor_inertia": ("Ia",),
}
"""Of a model that has a usual term for a drive, in any of its forms."""

FRICTION = (
    ({"Fc": 1.0, "Fcm": 1.0, "Fcp": 0.5, "Fcn": 0.5}, ("Fc", "Fc_cold", "Fc_settled", "Fq_spot")),
    ({"Fv": 1.0, "Fvp": 0.5, "Fvn": 0.5}, ("Fv", "Fn_linear", "Fv_cold", "Fv_settled")),
)
"""Dry and viscous friction of a drive, in the mean of both directions: shares of the usual terms in it, and
parameters of effects that change it."""


def friction_sign(robot: Robot) -> FrictionSign:
    """The arm's own form of the sign."""
    settings = robot.identification
    return FrictionSign(settings.friction_sign, settings.friction_width)


def _change(whole: float, share: float, present: PresentModel, place: Place, name: str) -> float:
    """Size of a usual term: a share of the whole where the model has it, all of it where it is what lacks."""
    return share * whole if present.has(SYMBOLS[name], place.joints[0]) else whole


def _viscous(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row = drive_row(robot, place)
    unit = f"{torque_unit(robot, place)}·s/{angle_unit(robot, place)}"

    def law(state: State) -> FloatArray:
        return along(row, state.velocity @ row)

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(damping=values[0] * np.outer(row, row))

    scale = _change(viscous_friction(robot, place), 0.3, present, place, "viscous_friction")
    return Parameters(("Fv",), (unit,), (ANY,), (scale,)), law, parts


def _coulomb(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign = drive_row(robot, place), friction_sign(robot)

    def law(state: State) -> FloatArray:
        return along(row, sign(state.velocity @ row))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(friction=(FrictionTorque(row, values[0] * row, sign),))

    scale = _change(dry_friction(robot, place), 0.3, present, place, "coulomb_friction")
    return Parameters(("Fc",), (torque_unit(robot, place),), (ANY,), (scale,)), law, parts


def _asymmetric(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """Half the difference of both directions: torque grows forwards and shrinks backwards."""
    row, sign = drive_row(robot, place), friction_sign(robot)
    torque, angle = torque_unit(robot, place), angle_unit(robot, place)

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        return along(row, np.abs(sign(speed)), np.abs(speed))

    def parts(values: FloatArray) -> SimulatedParts:
        # Half a Coulomb term forwards and half of one, of the other sign, backwards: |sign| is their sum.
        halves = [
            FrictionTorque(row, direction * value * row, form, direction)
            for value, form in zip(values, (sign, None), strict=True)
            for direction in (1, -1)
        ]
        return SimulatedParts(friction=tuple(halves))

    symbols = ("dFc", "dFv")
    scale = (0.3 * dry_friction(robot, place), 0.3 * viscous_friction(robot, place))
    return Parameters(symbols, (torque, f"{torque}·s/{angle}"), (ANY, ANY), scale), law, parts


def _asymmetric_dry(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """Half the difference of dry friction alone."""
    row, sign = drive_row(robot, place), friction_sign(robot)

    def law(state: State) -> FloatArray:
        return along(row, np.abs(sign(state.velocity @ row)))

    def parts(values: FloatArray) -> SimulatedParts:
        halves = [FrictionTorque(row, direction * values[0] * row, sign, direction) for direction in (1, -1)]
        return SimulatedParts(friction=tuple(halves))

    scale = (0.3 * dry_friction(robot, place),)
    return Parameters(("dFc",), (torque_unit(robot, place),), (ANY,), scale), law, parts


def _rotor_inertia(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row = drive_row(robot, place)
    unit = "kg·m²" if angle_unit(robot, place) == "rad" else "kg"

    def law(state: State) -> FloatArray:
        return along(row, state.acceleration @ row)

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(inertia=values[0] * np.outer(row, row))

    scale = _change(rotor_inertia(robot, place), 0.5, present, place, "rotor_inertia")
    return Parameters(("dIa",), (unit,), (ANY,), (scale,)), law, parts


def _current_offset(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row = drive_row(robot, place)

    def law(state: State) -> FloatArray:
        return along(row, np.ones(state.velocity.shape[0]))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(constant=values[0] * row)

    scale = (0.3 * dry_friction(robot, place),)
    return Parameters(("doff",), (torque_unit(robot, place),), (ANY,), scale), law, parts


VISCOUS_FRICTION = Family(
    "viscous_friction",
    "friction in proportion to the speed",
    "drive",
    each_drive,
    _viscous,
    confused_with=("nonlinear_viscous_friction",),
    settled_by="run the joint at several constant speeds: the torque is a straight line",
    equation="Fv·q̇",
    row=10,
)
COULOMB_FRICTION = Family(
    "coulomb_friction",
    "dry friction of constant size against the motion",
    "drive",
    each_drive,
    _coulomb,
    confused_with=("stribeck_friction", "load_dependent_friction"),
    settled_by="run the joint at several constant speeds: at none the torque is this",
    told_from={
        "load_dependent_friction": (
            "record the same motion with a known payload: friction of the load grows, dry friction does not"
        ),
    },
    equation="Fc·sign(q̇)",
    row=20,
)
ASYMMETRIC_DRY_FRICTION = Family(
    "asymmetric_friction",
    "dry friction that differs between the two directions of motion",
    "drive",
    each_drive,
    _asymmetric_dry,
    equation="dFc·|sign(q̇)|",
)
ASYMMETRIC_FRICTION = Family(
    "asymmetric_friction",
    "friction that differs between the two directions of motion",
    "drive",
    each_drive,
    _asymmetric,
    confused_with=("current_offset",),
    forms=(ASYMMETRIC_DRY_FRICTION,),
    settled_by="run the joint at one constant speed both ways: the torques differ",
    told_from={
        "current_offset": (
            "hold still under a known load, reached from both sides: an offset stays, friction turns"
        ),
    },
    not_by_motion=("current_offset",),
    equation="dFc·|sign(q̇)| + dFv·|q̇|: half the difference between both directions",
    row=30,
)
ROTOR_INERTIA = Family(
    "rotor_inertia",
    "inertia of rotor and gear, or a change of it",
    "drive",
    each_drive,
    _rotor_inertia,
    confused_with=("payload", "current_loop_lag", "time_delay"),
    settled_by="uncouple the motor and accelerate it alone: the torque is that of the rotor",
    told_from={
        "current_loop_lag": (
            "lock the joint and step the control signal: a lag rounds the current, a resting rotor does not"
        ),
        "time_delay": (
            "lock the joint and step the control signal: a delay shifts the current, a resting rotor does not"
        ),
    },
    equation="dIa·q̈",
    row=200,
)
CURRENT_OFFSET = Family(
    "current_offset",
    "constant offset of the measured torque",
    "drive",
    each_drive,
    _current_offset,
    needs_prior=True,
    confused_with=("asymmetric_friction", "gravity_spring"),
    settled_by=(
        "hold still with the arm upright, where gravity asks for no torque: what is left is the offset"
    ),
    equation="doff",
    row=170,
)
