"""Base tilt: an arm that does not stand as upright as its description says."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel
from ident.effects.placed import Family, Law, Parameters, Parts
from ident.effects.simulated import SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot


def _places(robot: Robot) -> tuple[Place, ...]:
    """An arm that gravity does not act on cannot be found tilted."""
    return (Place("base", ()),) if np.linalg.norm(robot.gravity) > 0 else ()


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A base that is turned by small angles about two axes sees gravity turned back about them."""
    gravity = np.array(robot.gravity)
    across = _across(gravity)
    turned = [np.cross(gravity, axis) for axis in across]

    def law(state: State) -> FloatArray:
        return np.stack([present.gravity_torque(state.position, change) for change in turned], axis=2)

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(gravity=values[0] * turned[0] + values[1] * turned[1])

    bounds = ((-0.5, 0.5), (-0.5, 0.5))
    return Parameters(("tilt_x", "tilt_y"), ("rad", "rad"), bounds, (0.03, 0.03)), law, parts


def _across(gravity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit axes across gravity; x and y of the base where it points down."""
    down = gravity / np.linalg.norm(gravity)
    x = np.eye(3)[int(np.argmin(np.abs(down)))]
    x = x - (x @ down) * down
    x /= np.linalg.norm(x)
    return x, np.cross(-down, x)


BASE_TILT = Family(
    "base_tilt",
    "gravity from another direction than described",
    "base",
    _places,
    _make,
    confused_with=("gravity_spring", "payload"),
    settled_by="put a level on the base: a tilt shows there",
    told_from={
        "gravity_spring": "put a level on the base: a tilt shows there, a spring does not",
        "payload": "put a level on the base: a tilt shows there, a payload does not",
    },
    equation="the base is turned by these angles about its x and y axes",
    row=240,
)
