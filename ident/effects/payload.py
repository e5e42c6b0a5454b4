"""Payload: a body at the tool that the model does not know of."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel
from ident.effects.placed import ANY, POSITIVE, Family, Law, Parameters, Parts
from ident.effects.rigid_body import RigidBody
from ident.effects.scales import payload
from ident.effects.simulated import SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot
from robots.standard import LINK_SYMBOLS

_UNITS = ("kg", *("kg·m",) * 3, *("kg·m²",) * 6)


def _places(robot: Robot) -> tuple[Place, ...]:
    return (Place("tool", ()),)


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """All ten about the last link's frame: a kilogram 0.1 m off it has as much inertia as a wrist."""
    body = RigidBody(robot)

    def law(state: State) -> FloatArray:
        return body.columns_from(robot.n - 1, state)

    def parts(values: FloatArray) -> SimulatedParts:
        links = np.zeros((robot.n, 10))
        links[-1, : len(LINK_SYMBOLS)] = values
        return SimulatedParts(links=links)

    symbols = tuple(f"{symbol}_payload" for symbol in LINK_SYMBOLS)
    mass, lever = payload(robot)
    scale = (mass, *(mass * lever,) * 3, *(mass * lever**2,) * 6)
    return Parameters(symbols, _UNITS, (POSITIVE, *(ANY,) * 9), scale), law, parts


PAYLOAD = Family(
    "payload",
    "a body at the tool that the model does not know of",
    "tool",
    _places,
    _make,
    needs_prior=True,
    essential=(0,),
    confused_with=("drive_gain_error", "rotor_inertia"),
    settled_by="take the tool off and record again: a payload leaves with it",
    told_from={
        "rotor_inertia": "take the tool off and record again: a payload leaves with it, a rotor does not",
    },
    equation="mass, first moments and inertia about the last link's frame",
    row=220,
)
