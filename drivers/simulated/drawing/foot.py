"""How a base that gives way is drawn: about which axes, and how slowly the arm rocks on it."""

from __future__ import annotations

import numpy as np

from drivers.simulated.drawing.places import Axes, Place
from drivers.simulated.drawing.shapes import Entries
from drivers.simulated.physics.assemble import inertia_on_foot
from drivers.simulated.plant import Plant

_AXES = (("roll",), ("pitch",), ("roll", "pitch"))
_STIFFEST, _SOFTEST = 120.0, 7.0
"""Hz, of the arm on its foot."""


def shape(rng: np.random.Generator, place: Place) -> Entries:
    """The axes, and the arm's inertia about them."""
    plant = Plant(place.robot, place.ruler.truth)
    inertia = inertia_on_foot(place.robot, plant.arm.chain)
    about = dict(zip(("roll", "pitch"), inertia.tolist(), strict=True))
    return {axis: about[axis] for axis in _AXES[int(rng.integers(len(_AXES)))]}


def entries(magnitude: float, place: Axes, drawn: Entries) -> Entries:
    """From a stiff foot to one on which the arm rocks at 7 Hz."""
    turn = 2.0 * np.pi * _STIFFEST * (_SOFTEST / _STIFFEST) ** magnitude
    return {"base_compliance": {axis: float(inertia * turn**2) for axis, inertia in drawn.items()}}
