"""Stribeck friction: dry friction that falls as the film of lubricant builds up with speed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.hysteresis import deflection
from ident.effects.placed import (
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    angle_unit,
    drive_row,
    each_drive,
    speed_limit,
    torque_unit,
)
from ident.effects.scales import dry_friction
from ident.effects.simulated import Bristle, FrictionTorque, SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_STATIC_SHARE = 0.0025
"""Of the speed limit: friction that falls within less than this shows at breakaway alone."""

_PRESLIDING = (5e-5, 2e-4, 1e-3)
"""rad (or m); friction that takes longer to build up is hysteresis."""

_EXPONENT = Shape("exponent", "1", (1.0, 2.0), 0.5, 4.0, fixed=True)
"""1 is Tustin's form of the fall, 2 that of Gauss."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, (stribeck_speed, exponent) = drive_row(robot, place), friction_sign(robot), shape

    def fall(speed: FloatArray) -> FloatArray:
        return np.asarray(np.exp(-(np.abs(speed / stribeck_speed) ** exponent)))

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        return along(row, sign(speed) * fall(speed))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(friction=(FrictionTorque(row, values[0] * row, sign, speed_factor=fall),))

    scale = (0.7 * dry_friction(robot, place),)
    return Parameters(("Fs",), (torque_unit(robot, place),), (POSITIVE,), scale), law, parts


def _moving_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    limit = speed_limit(robot, drive_row(robot, place))
    grid = tuple(float(limit * share) for share in (0.003, 0.005, 0.01, 0.02, 0.04, 0.08, 0.16))
    unit = f"{angle_unit(robot, place)}/s"
    return (Shape("stribeck_speed", unit, grid, _STATIC_SHARE * limit, 0.4 * limit, True), _EXPONENT)


def _breakaway(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A level above that of motion at next to no speed, and a share of it that builds up over a way.

    Before it slides a gear bends; where it bends farther than others, friction comes late at each reversal.
    """
    row, sign, (breakaway_speed, length) = drive_row(robot, place), friction_sign(robot), shape
    level, of_level, parts_of_level = _breakaway_at_once(robot, place, (breakaway_speed,), present)

    def law(state: State) -> FloatArray:
        speed = state.velocity @ row
        late = np.zeros_like(speed)
        if state.time is not None:
            # A drive that moves as the record begins has moved before: its first sample is no reversal.
            begun = float(np.sign(speed[0]))
            late = deflection(state.position @ row, length, begun) - sign(speed)
        return np.concatenate([of_level(state), along(row, late)], axis=2)

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(
            friction=(
                *parts_of_level(values[:1]).friction,
                FrictionTorque(row, values[1] * row, Bristle(length, "exponential")),
                FrictionTorque(row, -values[1] * row, sign),
            )
        )

    known, _ = present.drive_friction(place.joints[0])
    late = (0.0, known if known > 0.0 else np.inf)  # of more, what is left would push the drive on
    parameters = Parameters(
        (*level.symbols, "Flate"),
        level.units * 2,
        (*level.bounds, late),
        (*level.scale, 0.5 * dry_friction(robot, place)),
    )
    return parameters, law, parts


def _breakaway_at_once(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """The same level alone: all of it is there as soon as the drive turns."""
    parameters, law, parts = _make(robot, place, (*shape, 2.0), present)
    return replace(parameters, symbols=("Fbreak",)), law, parts


def _breakaway_speeds(robot: Robot, place: Place) -> tuple[Shape, ...]:
    limit = speed_limit(robot, drive_row(robot, place))
    unit = f"{angle_unit(robot, place)}/s"
    return (Shape("breakaway_speed", unit, (0.001 * limit,), 0.0002 * limit, _STATIC_SHARE * limit, True),)


def _breakaway_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    unit = angle_unit(robot, place)
    return (*_breakaway_speeds(robot, place), Shape("presliding", unit, _PRESLIDING, 3e-5, 3e-3, True))


STRIBECK_FRICTION = Family(
    "stribeck_friction",
    "dry friction that falls with speed as the lubricant's film builds up",
    "drive",
    each_drive,
    _make,
    _moving_shapes,
    contains=("coulomb_friction",),
    on_top_of=("coulomb_friction",),
    confused_with=("nonlinear_viscous_friction", "static_friction"),
    shows="both",
    settled_by="let the joint creep at several constant speeds below a hundredth of its limit",
    equation="Fs·sign(q̇)·exp(−|q̇/speed|^exponent), on top of Coulomb friction, so Fs is the rise",
    row=40,
)
_BREAKAWAY = "friction to break away from standstill that is larger than friction in motion"
BREAKAWAY_AT_ONCE = Family(
    "static_friction",
    _BREAKAWAY,
    "drive",
    each_drive,
    _breakaway_at_once,
    _breakaway_speeds,
    on_top_of=("coulomb_friction",),
    shows="reversal",
    equation="`Fbreak` alone, with nothing that builds up over a way",
)
STATIC_FRICTION = Family(
    "static_friction",
    _BREAKAWAY,
    "drive",
    each_drive,
    _breakaway,
    _breakaway_shapes,
    on_top_of=("coulomb_friction",),
    confused_with=("stribeck_friction", "hysteresis"),
    shows="reversal",
    forms=(BREAKAWAY_AT_ONCE,),
    history=True,
    settled_by="raise the torque of the resting joint slowly until it breaks away",
    told_from={
        "stribeck_friction": "raise the torque of the resting joint slowly until it breaks away",
    },
    equation=(
        "as `stribeck_friction`, within a few per mille of the speed limit, where it shows at breakaway"
        " alone; `Flate`, at most the drive's dry friction, is what builds up over the way `presliding`"
    ),
    row=50,
)
