"""Directional gear efficiency: friction of the load that differs between driving it and being driven."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.effects.family import Place, PresentModel
from ident.effects.gear_load import GearLoad, at_once, late_form
from ident.effects.placed import (
    ANY,
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    each_drive,
)
from ident.effects.simulated import SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """With L through the gear: (mu + dmu)·|L|·sign(q̇) where L·q̇ > 0, (mu − dmu)·|L|·sign(q̇) elsewhere.

    A gear of efficiency η takes (1/η − 1)·|L| while it drives the load, and (1 − η')·|L| while the load
    drives it: worm and hypoid gears differ in the two.
    """
    row, sign = drive_row(robot, place), friction_sign(robot)
    through = GearLoad(robot, place, present, *shape)

    def law(state: State) -> FloatArray:
        load, direction = through.torque(state), sign(state.velocity @ row)
        return along(row, np.abs(load) * direction, load * direction**2)

    def parts(values: FloatArray) -> SimulatedParts:
        mean, half = float(values[0]), float(values[1])
        both = (through.friction(mean + half, "driving"), through.friction(mean - half, "driven"))
        return SimulatedParts(friction=both)

    symbols = ("mu_mean", "dmu")
    return Parameters(symbols, ("1", "1"), (POSITIVE, ANY), (0.15, 0.1)), law, parts


_AT_ONCE = Family(
    "directional_efficiency",
    "friction of the load that differs between driving it and being driven by it",
    "drive",
    each_drive,
    _make,
    at_once,
    essential=(1,),
    contains=("load_dependent_friction", "drive_gain_error"),
    confused_with=("load_dependent_friction", "drive_gain_error"),
    settled_by="lift a known weight slowly and lower it: the gear takes more of one way than of the other",
    told_from={
        "load_dependent_friction": "lift a known weight slowly and lower it: friction of the load takes as"
        " much of both",
        "drive_gain_error": "hold a known payload still, reached from both sides: friction turns its sign, a"
        " gain does not",
    },
    equation=(
        "with the torque L through the gear: mu_mean·|L|·sign(q̇) + dmu·L·sign(q̇)²; the gear "
        "takes mu_mean + dmu of its load while it drives it and mu_mean − dmu while driven by it"
    ),
)
DIRECTIONAL_EFFICIENCY = replace(_AT_ONCE, row=80, forms=(late_form(_AT_ONCE),))
