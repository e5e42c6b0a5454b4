"""Friction that depends on where the joint is: a worn or tight place of gear or bearing."""

from __future__ import annotations

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
    torque_unit,
)
from ident.effects.scales import dry_friction
from ident.effects.simulated import FrictionTorque, SimulatedParts, Table
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_MARGIN = 0.5
"""rad (or m) beyond the limits that the simulation's table reaches."""
_WAVES = (0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
"""Per rad, or over the whole travel of what slides: where the search begins."""
_FEWEST, _MOST = 0.5, 8.0
_CENTRES = (0.1, 0.22, 0.34, 0.46, 0.58, 0.7, 0.82, 0.94)
_WIDTHS = (0.02, 0.06, 0.12, 0.24, 0.5)
"""Of a spot, shares of the travel: where the search begins; between the narrowest and the widest."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, (waves,) = drive_row(robot, place), friction_sign(robot), shape

    def law(state: State) -> FloatArray:
        position, direction = state.position @ row, sign(state.velocity @ row)
        return along(row, direction * np.cos(waves * position), direction * np.sin(waves * position))

    def parts(values: FloatArray) -> SimulatedParts:
        reach = float(np.abs(row) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))) + _MARGIN

        def curve(position: FloatArray) -> FloatArray:
            return np.asarray(values[0] * np.cos(waves * position) + values[1] * np.sin(waves * position))

        table = Table.of(curve, -reach, reach)
        return SimulatedParts(friction=(FrictionTorque(row, row, sign, position_row=row, curve=table),))

    unit = torque_unit(robot, place)
    symbols = ("Fq_cos", "Fq_sin")
    scale = (0.3 * dry_friction(robot, place),) * 2
    return Parameters(symbols, (unit, unit), (ANY, ANY), scale), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    unit, (low, high) = angle_unit(robot, place), _travel(robot, drive_row(robot, place))
    one = 1.0 if unit == "rad" else 2.0 * np.pi / (high - low)
    grid = tuple(one * waves for waves in _WAVES)
    return (Shape("waves", f"1/{unit}", grid, one * _FEWEST, one * _MOST),)


def _spot(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    row, sign, (centre, width) = drive_row(robot, place), friction_sign(robot), shape

    def bell(position: FloatArray) -> FloatArray:
        return np.asarray(np.exp(-0.5 * ((position - centre) / width) ** 2))

    def law(state: State) -> FloatArray:
        return along(row, sign(state.velocity @ row) * bell(state.position @ row))

    def parts(values: FloatArray) -> SimulatedParts:
        low, high = _travel(robot, row)
        table = Table.of(lambda q: values[0] * bell(q), low - _MARGIN, high + _MARGIN)
        return SimulatedParts(friction=(FrictionTorque(row, row, sign, position_row=row, curve=table),))

    scale = (0.5 * dry_friction(robot, place),)
    return Parameters(("Fq_spot",), (torque_unit(robot, place),), (ANY,), scale), law, parts


def _travel(robot: Robot, row: FloatArray) -> tuple[float, float]:
    """Lowest and highest position of a drive's output within the joints' limits."""
    ends = np.stack([row * robot.lower, row * robot.upper])
    return float(ends.min(axis=0).sum()), float(ends.max(axis=0).sum())


def _spot_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    low, high = _travel(robot, drive_row(robot, place))
    travel, unit = high - low, angle_unit(robot, place)
    centres = tuple(float(low + share * travel) for share in _CENTRES)
    narrowest, *widths, widest = (float(share * travel) for share in _WIDTHS)
    return (
        Shape("spot_centre", unit, centres, float(low), float(high)),
        Shape("spot_width", unit, tuple(widths), narrowest, widest, True),
    )


TIGHT_SPOT = Family(
    "position_dependent_friction",
    "dry friction that is larger, or smaller, around one position of the joint",
    "drive",
    each_drive,
    _spot,
    _spot_shapes,
    contains=("coulomb_friction",),
    several=True,
    confused_with=("load_dependent_friction",),
)

POSITION_DEPENDENT_FRICTION = Family(
    "position_dependent_friction",
    "dry friction that depends on the position of the joint",
    "drive",
    each_drive,
    _make,
    _shapes,
    contains=("coulomb_friction",),
    several=True,
    confused_with=("load_dependent_friction",),
    forms=(TIGHT_SPOT,),
    settled_by="turn the joint slowly through its range: the torque follows the place",
    told_from={
        "load_dependent_friction": (
            "record the same motion with a known payload: friction of the load grows, the other does not"
        ),
    },
    equation=(
        "sign(q̇)·(Fq_cos·cos(waves·q) + Fq_sin·sin(waves·q)) or, of a tight spot, "
        "sign(q̇)·Fq_spot·exp(−½((q − spot_centre)/spot_width)²)"
    ),
    row=100,
)
