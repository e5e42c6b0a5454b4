"""What links feel where they give way: loads along each place, and what its way and the others' change.

Torques of links that are farther along a way are their slopes along it (:class:`ident.effects.ways.Slopes`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ident.effects.family import PresentModel
from ident.effects.foot import AXES
from ident.effects.gear_state import between
from ident.effects.state import State
from ident.effects.ways import Pliant, Slopes
from robots.arrays import FloatArray

_LEAST = 0.01
"""Of the described inertia at home: parameters that were fitted need be no body's."""
_APART = 0.05
"""Least eigenvalue of a mass matrix over that of the same masses apart: with less they are no body's."""


@dataclass(frozen=True, eq=False)
class Course:
    """What links feel at places: at the samples, and at points between them and before the first.

    Attributes:
        slopes: of each place, of the torques on foot and joints.
        load, matrix: (points, places) and (points, places, places, 3): the load of each, and what it feels of
            the others' ways, speeds and accelerations.
        before: samples before the first.
    """

    slopes: tuple[Slopes, ...]
    load: FloatArray
    matrix: FloatArray
    before: int


def felt(places: Sequence[Pliant], present: PresentModel, state: State) -> Course:
    """What links feel at places."""
    on_foot = any(one.of_foot for one in places)
    still = _torques(present, on_foot, state, np.zeros(len(places[0].along)))
    slopes = tuple(_slopes(present, on_foot, state, one.along) for one in places)
    directions = np.stack([one.along for one in places])
    offset = np.concatenate([np.zeros(AXES), present.offset_torque()])
    load = -np.stack([(still + one.offset * offset) @ one.along for one in places], axis=1)
    matrix = np.einsum("aj,bjds->sabd", directions, np.stack([one.each for one in slopes]))
    _as_of_bodies(matrix, np.array([one.described for one in places]))
    k = len(places)
    points, before = between(np.hstack([load, matrix.reshape(load.shape[0], -1)]), state)
    finer = np.ascontiguousarray(points[k:].T).reshape(-1, k, k, 3)
    for number in range(k):  # where an inertia jumps a spline would go below nothing
        own = matrix[:, number, number, 2]
        np.clip(finer[:, number, number, 2], own.min(), own.max(), out=finer[:, number, number, 2])
    return Course(slopes, np.ascontiguousarray(points[:k].T), finer, before)


def _as_of_bodies(matrix: FloatArray, described: FloatArray) -> None:
    """Parameters that were fitted need be no body's: then places have some mass each, and feel no other."""
    mass, least = matrix[..., 2], _LEAST * described
    diagonal = np.einsum("saa->sa", mass)
    light = diagonal <= least
    np.maximum(diagonal, least, out=diagonal)
    for number in range(described.size):
        matrix[light[:, number], number, :, :2] = 0.0
    root = np.sqrt(diagonal)
    eigenvalues = np.linalg.eigvalsh(mass / (root[:, :, np.newaxis] * root[:, np.newaxis])).min(axis=1)
    apart = eigenvalues < _APART
    others = ~np.eye(described.size, dtype=bool)
    matrix[np.ix_(apart, range(described.size), range(described.size))] *= ~others[..., np.newaxis]


def _slopes(present: PresentModel, on_foot: bool, state: State, along: FloatArray) -> Slopes:
    """Of the torques on foot and joints; kept with the motion."""

    def made() -> Slopes:
        torques = partial(_torques, present, on_foot, state, along)
        return Slopes.of(torques(0.0, 0.0, 0.0), torques)

    return state.once(present, ("slopes along", along.tobytes(), on_foot), made)


def _torques(
    present: PresentModel,
    on_foot: bool,
    state: State,
    along: FloatArray,
    way: float = 0.0,
    rate: float = 0.0,
    push: float = 0.0,
) -> FloatArray:
    """Samples × (2 + joints), of links that are farther along a way; none on a foot that nobody asks of."""
    more = way * along, rate * along, push * along
    motion = (state.position, state.velocity, state.acceleration)
    moved = state.moved(*(own + one[AXES:] for own, one in zip(motion, more, strict=True)))
    if not on_foot:
        return np.pad(present.link_torque(moved), ((0, 0), (AXES, 0)))
    rocking = np.broadcast_to(np.stack(more)[:, :AXES], (state.position.shape[0], 3, AXES))
    return present.foot_torque(moved, np.ascontiguousarray(rocking))
