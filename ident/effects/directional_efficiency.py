"""Directional gear efficiency: friction of the load that differs between driving it and being driven."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape, State
from ident.effects.placed import (
    ANY,
    OFFSET_AT_LINK,
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    drive_torque,
    each_drive,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts
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
    row, sign, drive = drive_row(robot, place), friction_sign(robot), place.joints[0]
    (offset_at_link,) = shape

    def law(state: State) -> FloatArray:
        torque = present.link_torque(state) + offset_at_link * present.offset_torque()
        load, direction = drive_torque(robot, torque, drive), sign(state.velocity @ row)
        return along(row, np.abs(load) * direction, load * direction**2)

    def parts(values: FloatArray) -> SimulatedParts:
        load_row = np.asarray(np.linalg.inv(robot.transmission_matrix)[:, drive], dtype=np.float64)
        mean, half = float(values[0]), float(values[1])
        return SimulatedParts(
            friction=(
                FrictionTorque(row, (mean + half) * row, sign, load_row=load_row, load_side="driving"),
                FrictionTorque(row, (mean - half) * row, sign, load_row=load_row, load_side="driven"),
            )
        )

    symbols = ("mu_mean", "dmu")
    return Parameters(symbols, ("1", "1"), (POSITIVE, ANY), (0.15, 0.1)), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (OFFSET_AT_LINK,)


DIRECTIONAL_EFFICIENCY = Family(
    "directional_efficiency",
    "friction of the load that differs between driving it and being driven by it",
    "drive",
    each_drive,
    _make,
    _shapes,
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
    row=80,
)
