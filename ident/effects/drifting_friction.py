"""Friction that changes with the warmth of its gear: cold at the start, heated by friction itself.

Robot friction follows the temperature in the joint (Carvalho Bittencourt et al., IROS 2010), which can be
worked out from the motion where nothing measures it (Simoni, Beschi, Legnani and Visioli, IFAC 2017). Here
the gear is a first-order store of heat, time constant T: its temperature above the surroundings is what is
left of that at the start, exp(−t/T), and the power of friction behind the lag T. Dry and viscous friction
change with it each by its own factor, to first order, so that they are linear in both causes. How warm the
gear was at the start is not known, nor need the warming end within the recording.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
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
    over_time,
    torque_unit,
)
from ident.effects.scales import dry_friction, friction_power, viscous_friction
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from ident.effects.warming import Warming
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, (settling,) = drive_row(robot, place), friction_sign(robot), shape
    torque, angle = torque_unit(robot, place), angle_unit(robot, place)

    def warming() -> Warming:
        return Warming(settling, *present.drive_friction(place.joints[0]))

    def course(time: FloatArray) -> FloatArray:
        return np.exp(-time / settling)

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        fading = np.ones_like(speed) if state.time is None else course(state.time)
        warmth = warming().warmth(speed, state.time)
        dry = sign(speed)
        return along(row, fading * dry, fading * speed, warmth * dry, warmth * speed)

    def parts(values: FloatArray) -> SimulatedParts:
        table, heat = over_time(course), warming()
        fading = zip(values[:2], (sign, None), strict=True)
        heated = zip(values[2:], (sign, None), strict=True)
        return SimulatedParts(
            friction=(
                *(FrictionTorque(row, v * row, form, course=table) for v, form in fading),
                *(FrictionTorque(row, v * row, form, warming=heat) for v, form in heated),
            )
        )

    symbols = ("Fc_cold", "Fv_cold", "Fc_heat", "Fv_heat")
    units = (torque, f"{torque}·s/{angle}", f"{torque}/W", f"{torque}·s/({angle}·W)")
    # Oil gets thinner as it warms; dry friction has been seen to go either way.
    dry, viscous = 0.3 * dry_friction(robot, place), 0.3 * viscous_friction(robot, place)
    power = friction_power(robot, place)
    scale = (dry, viscous, dry / power, viscous / power)
    return Parameters(symbols, units, (ANY, ANY, ANY, (-np.inf, 0.0)), scale), law, parts


def settling_times(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Of a gear that cools down to its surroundings."""
    return (Shape("settling_time", "s", (5.0, 12.0, 30.0, 100.0, 400.0), 2.0, 2000.0, True),)


def moving_away(shape: tuple[float, ...]) -> Callable[[FloatArray], FloatArray]:
    """The share of its way that friction has gone, over the time, s: shape (time_constant[, to_go])."""
    settling, to_go = (*shape, 1.0)[:2]

    def course(time: FloatArray) -> FloatArray:
        return np.asarray(1.0 - to_go * np.exp(-time / settling))

    return course


def _settling(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """Friction that moves away from the model's."""
    row, sign, course = drive_row(robot, place), friction_sign(robot), moving_away(shape)
    torque, angle = torque_unit(robot, place), angle_unit(robot, place)

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        gone = course(np.zeros_like(speed) if state.time is None else state.time)
        return along(row, gone * sign(speed), gone * speed)

    def parts(values: FloatArray) -> SimulatedParts:
        table = over_time(course)
        pairs = zip(values, (sign, None), strict=True)
        return SimulatedParts(
            friction=tuple(FrictionTorque(row, v * row, form, course=table) for v, form in pairs)
        )

    symbols = ("Fc_settled", "Fv_settled")
    scale = (0.3 * dry_friction(robot, place), 0.3 * viscous_friction(robot, place))
    return Parameters(symbols, (torque, f"{torque}·s/{angle}"), (ANY, ANY), scale), law, parts


def time_constants(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Of friction that moves away from that of the model."""
    return (Shape("time_constant", "s", (3.0, 8.0, 20.0, 60.0), 1.0, 600.0, True),)


def begun_before(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Of friction that had gone a part of its way: arms move before they are recorded."""
    return (*time_constants(robot, place), Shape("to_go", "-", (0.7, 0.3), 0.05, 1.0))


SETTLING_FRICTION = Family(
    "drifting_friction",
    "friction that moves away from that of the model",
    "drive",
    each_drive,
    _settling,
    time_constants,
    contains=("coulomb_friction", "viscous_friction", "temperature_viscous_friction", "wrist_coupling"),
    confused_with=("coulomb_friction", "viscous_friction"),
)
SETTLING_BEFORE = replace(
    SETTLING_FRICTION,
    sentence="friction that had begun to move away from that of the model before the recording did",
    shapes_of=begun_before,
)
DRIFTING_FRICTION = Family(
    "drifting_friction",
    "friction that changes while the gear warms up",
    "drive",
    each_drive,
    _make,
    settling_times,
    contains=("coulomb_friction", "viscous_friction", "temperature_viscous_friction", "wrist_coupling"),
    confused_with=("coulomb_friction", "viscous_friction"),
    forms=(SETTLING_FRICTION, SETTLING_BEFORE),
    history=True,
    settled_by="record the same motion cold and warm: only what drifts has changed",
    equation=(
        "(Fc_cold·sign(q̇) + Fv_cold·q̇)·exp(−t/settling_time) is what friction has more (or "
        "less) at the start than in a gear as warm as its surroundings; (Fc_heat·sign(q̇) + "
        "Fv_heat·q̇)·w is what its own heat changes. w is the power of the drive's friction in W,"
        " from `Fc` and `Fv` of the model, behind a first-order lag of settling_time. A recording"
        " that follows another one starts as warm as motions like its own have made the gear by "
        "then. Or, away from the friction of the model, (Fc_settled·sign(q̇) + Fv_settled·q̇)·(1 − to_go·"
        "exp(−t/time_constant)): to_go is 1 where it begins with the recording, and less where the arm"
        " had moved before"
    ),
    row=90,
)
