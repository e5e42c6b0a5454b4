"""Viscous friction that follows the warmth of the oil, where dry friction stays as it is.

Oil gets thinner as it warms, and what it takes in proportion to the speed follows: the term F_v,T of Carvalho
Bittencourt, Axelsson, Jung and Brogårdh (IROS 2011), who found dry friction of a robot's joint to depend on
the load far more than on temperature. Warmth as in ``drifting_friction``, of which this is the half without
dry friction: what is left of the start's, and the power of friction behind a lag.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.effects.drifting_friction import begun_before, moving_away, settling_times, time_constants
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
    over_time,
    torque_unit,
)
from ident.effects.scales import friction_power, viscous_friction
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.state import State
from ident.effects.warming import Warming
from robots.arrays import FloatArray
from robots.description import Robot

_SHARE = 0.3
"""Of viscous friction, deviation of a change."""
_THINNER = (-np.inf, 0.0)
"""No oil gets thicker as it warms."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """What is left of the start's warmth, and what friction heats since."""
    row, (settling,) = drive_row(robot, place), shape
    torque, angle = torque_unit(robot, place), angle_unit(robot, place)

    def warming() -> Warming:
        return Warming(settling, *present.drive_friction(place.joints[0]))

    def course(time: FloatArray) -> FloatArray:
        return np.exp(-time / settling)

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        left = np.ones_like(speed) if state.time is None else course(state.time)
        return along(row, left * speed, warming().warmth(speed, state.time) * speed)

    def parts(values: FloatArray) -> SimulatedParts:
        left, heated = values[0] * row, values[1] * row
        table = over_time(course)
        return SimulatedParts(
            friction=(
                FrictionTorque(row, left, None, course=table),
                FrictionTorque(row, heated, None, warming=warming()),
            )
        )

    size = _SHARE * viscous_friction(robot, place)
    units = (f"{torque}·s/{angle}", f"{torque}·s/({angle}·W)")
    scale = (size, size / friction_power(robot, place))
    return Parameters(("Fv_oil_cold", "Fv_oil_heat"), units, (ANY, _THINNER), scale), law, parts


def _settling(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """Oil that becomes warmer or colder than the model's."""
    row, course = drive_row(robot, place), moving_away(shape)
    unit = f"{torque_unit(robot, place)}·s/{angle_unit(robot, place)}"

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        return along(row, course(np.zeros_like(speed) if state.time is None else state.time) * speed)

    def parts(values: FloatArray) -> SimulatedParts:
        table = over_time(course)
        return SimulatedParts(friction=(FrictionTorque(row, values[0] * row, None, course=table),))

    scale = (_SHARE * viscous_friction(robot, place),)
    return Parameters(("Fv_oil_settled",), (unit,), (ANY,), scale), law, parts


OIL_THAT_SETTLES = Family(
    "temperature_viscous_friction",
    "viscous friction that moves away from that of the model as the oil warms",
    "drive",
    each_drive,
    _settling,
    time_constants,
    contains=("viscous_friction",),
    history=True,
)
OIL_THAT_SETTLED_BEFORE = replace(
    OIL_THAT_SETTLES,
    sentence="viscous friction that had begun to move away from that of the model before the recording did",
    shapes_of=begun_before,
)
TEMPERATURE_VISCOUS_FRICTION = Family(
    "temperature_viscous_friction",
    "viscous friction that falls as the oil warms, beside dry friction that stays",
    "drive",
    each_drive,
    _make,
    settling_times,
    contains=("viscous_friction",),
    confused_with=("viscous_friction", "drifting_friction"),
    forms=(OIL_THAT_SETTLES, OIL_THAT_SETTLED_BEFORE),
    history=True,
    settled_by="record the same motion cold and warm: it has changed, and nothing has at creeping speed",
    told_from={
        "drifting_friction": (
            "let the joint creep cold and warm: dry friction shows there, and of oil nothing has changed"
        ),
    },
    equation=(
        "q̇·(Fv_oil_cold·exp(−t/settling_time) + Fv_oil_heat·w) with the warmth w of `drifting_friction`; or,"
        " of oil that moves away from the model's, Fv_oil_settled·q̇·(1 − to_go·exp(−t/time_constant))"
    ),
    row=92,
)
