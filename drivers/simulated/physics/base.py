"""A base that gives way: the whole arm rocks about the axes x and y of its foot.

Two joints stand before the arm's own, with springs and dampers instead of drives; what the foot itself weighs
is a round plate on them. In each substep their speeds are eliminated before those of the joints are solved
for, and follow from these (Gauss). Where the base is firm there are none, and nothing is done.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from drivers.simulated.physics import chain
from drivers.simulated.physics.chain import Chain, frame_along
from drivers.simulated.physics.compile import inner
from robots.arrays import FloatArray

if TYPE_CHECKING:
    from drivers.simulated.effects.loads import BaseCompliance

_DAMPING = 0.05
"""Ratio to critical where a scenario gives none: a bolted steel foot."""


class Base(NamedTuple):
    """The foot; b of its axes x and y give way."""

    chain: Chain
    """Of b + n joints."""
    stiffness: FloatArray
    """(b,) N·m/rad."""
    damping: FloatArray
    """(b,) N·m·s/rad."""
    mass: FloatArray
    """(b + n, b + n) scratch."""
    loads: FloatArray
    """(b + n,) scratch."""
    position: FloatArray
    """(b + n,) scratch."""
    velocity: FloatArray
    """(b + n,) scratch."""
    matrix: FloatArray
    """(b + n, b + n) scratch: eliminated."""
    right: FloatArray
    """(b + n,) scratch: eliminated."""


ANGLE, RATE, CHANGE = 0, 1, 2
"""Rows of (3, b), how the foot moves: angles, their rates, and the rates' change in the last step."""


def firm(arm: Chain) -> Base:
    """A base that does not give way."""
    none = np.zeros(0)
    return Base(arm, none, none, np.zeros((0, 0)), none, none, none, np.zeros((0, 0)), none)


def soft(arm: Chain, given: BaseCompliance, inertia: FloatArray) -> Base:
    """A base that gives way as a scenario says.

    Args:
        arm: of the joints alone.
        given: the entry of the scenario.
        inertia: (2,) of the arm about x and y of its foot in a usual posture, kg·m².
    """
    axes = [axis for axis, stiffness in enumerate((given.roll, given.pitch)) if stiffness is not None]
    stiffness = np.array([k for k in (given.roll, given.pitch) if k is not None])
    damping = 2.0 * _DAMPING * np.sqrt(stiffness * (inertia[axes] + given.plate))
    size = len(axes) + len(arm.slides)
    square, row = (size, size), size
    return Base(
        chain=rocking_chain(arm, axes, given.plate),
        stiffness=stiffness,
        damping=damping,
        mass=np.zeros(square),
        loads=np.zeros(row),
        position=np.zeros(row),
        velocity=np.zeros(row),
        matrix=np.zeros(square),
        right=np.zeros(row),
    )


def rocking_chain(arm: Chain, axes: Sequence[int], plate: float) -> Chain:
    """The arm's chain behind turns about axes (0 is x, 1 is y) of its foot.

    Args:
        arm: the chain.
        axes: one or two.
        plate: moment of inertia of the foot about any axis, kg·m².
    """
    b, before, turns = len(axes), np.eye(3), []
    for axis in axes:
        along = frame_along(np.eye(3)[axis])
        turns.append((before.T @ along).ravel())
        before = along
    rotation = np.vstack([*turns, arm.rotation])
    rotation[b] = (before.T @ arm.rotation[0].reshape(3, 3)).ravel()
    offset = np.vstack([np.zeros((b, 3)), arm.offset])
    offset[b] = before.T @ arm.offset[0]
    links = np.vstack([np.zeros((b, 10)), arm.links])
    links[b - 1, [4, 6, 9]] = plate
    slides = np.concatenate([np.zeros(b, dtype=np.bool_), arm.slides])
    return Chain(rotation, offset, slides, links, arm.gravity, np.zeros((len(slides), arm.work.shape[1])))


@inner
def posture(
    base: Base,
    rocking: FloatArray,
    position: FloatArray,
    coming: FloatArray,
    mass: FloatArray,
    loads: FloatArray,
) -> None:
    """Mass matrix (n, n) and loads (n,) of the links on their base, in place; the base's own stay in it.

    Args:
        base, rocking: the foot.
        position, coming: (n,) of the joints, and their speeds in the middle of the step.
        mass, loads: written.
    """
    b, n = len(base.stiffness), len(position)
    for a in range(b):
        base.position[a] = rocking[ANGLE, a]
        base.velocity[a] = rocking[RATE, a] + 0.5 * rocking[CHANGE, a]
    for j in range(n):
        base.position[b + j], base.velocity[b + j] = position[j], coming[j]
    chain.place(base.chain, base.position)
    chain.mass_matrix(base.chain, base.mass)
    chain.bias(base.chain, base.velocity, base.loads)
    for j in range(n):
        loads[j] = base.loads[b + j]
        for k in range(n):
            mass[j, k] = base.mass[b + j, b + k]


@inner
def eliminate(base: Base, rocking: FloatArray, matrix: FloatArray, right: FloatArray, step: float) -> None:
    """Takes the base's speeds out of the equations ``matrix · change = right`` of the joints, in place.

    Args:
        base, rocking: the foot, for the posture of :func:`posture`.
        matrix, right: (n, n) and (n,), of links alone.
        step: s.
    """
    b, n = len(base.stiffness), len(right)
    for i in range(b + n):
        for k in range(b + n):
            base.matrix[i, k] = base.mass[i, k]
    for a in range(b):
        spring, damping = base.stiffness[a], base.damping[a]
        base.right[a] = -step * (base.loads[a] + spring * rocking[ANGLE, a] + damping * rocking[RATE, a])
        # Trapezoidal rule: stable at any stiffness, and without damping of its own.
        base.matrix[a, a] += step * (0.5 * damping + 0.25 * step * spring)
    for j in range(n):
        base.right[b + j] = right[j]
    for a in range(b):
        for i in range(a + 1, b + n):
            share = base.matrix[i, a] / base.matrix[a, a]
            base.right[i] -= share * base.right[a]
            for k in range(a, b + n):
                base.matrix[i, k] -= share * base.matrix[a, k]
    for j in range(n):
        right[j] = base.right[b + j]
        for k in range(n):
            matrix[j, k] = base.matrix[b + j, b + k]


@inner
def follow(base: Base, rocking: FloatArray, change: FloatArray, step: float) -> None:
    """Moves the base by one substep in which the joints' speeds changed by ``change``, (n,)."""
    b, n = len(base.stiffness), len(change)
    for back in range(b):
        a = b - 1 - back
        value = base.right[a]
        for k in range(a + 1, b):
            value -= base.matrix[a, k] * rocking[CHANGE, k]
        for j in range(n):
            value -= base.matrix[a, b + j] * change[j]
        rocking[CHANGE, a] = value / base.matrix[a, a]
    for a in range(b):
        rocking[RATE, a] += rocking[CHANGE, a]
        rocking[ANGLE, a] += step * rocking[RATE, a]


@inner
def lean(base: Base, rocking: FloatArray, position: FloatArray, loads: FloatArray) -> None:
    """Leans the resting base by the weight on it as it leans, and writes that weight's ``loads``, (n,)."""
    b, n = len(base.stiffness), len(position)
    for a in range(b):
        base.position[a] = rocking[ANGLE, a]
    for i in range(b + n):
        base.velocity[i] = 0.0
    for j in range(n):
        base.position[b + j] = position[j]
    chain.place(base.chain, base.position)
    chain.bias(base.chain, base.velocity, base.loads)
    for a in range(b):
        rocking[ANGLE, a] = -base.loads[a] / base.stiffness[a]
    for j in range(n):
        loads[j] = base.loads[b + j]
