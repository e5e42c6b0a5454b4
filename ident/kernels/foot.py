"""Compiled motion of a base that gives way, in the step of the closed loop.

Two joints before the arm's own, with a spring and a damper each. Their speeds are eliminated from the
equations of a step before those of the joints are solved for, and follow from these (Gauss); the trapezoidal
rule holds them stable at any stiffness, without damping of its own.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ident.kernels.compilation import compiled
from ident.kernels.rigid_bodies import mass_and_bias
from ident.kernels.values import Axes
from robots.arrays import FloatArray

ANGLE, RATE, CHANGE = 0, 1, 2
"""Rows of ``Foot.moving``."""


class Foot(NamedTuple):
    """The foot and the arm on it; every array is empty where it is firm."""

    axes: Axes
    """(0, 1, … n + 1), or ()."""
    frames: FloatArray
    """(2 + n, 37)."""
    links: FloatArray
    """(2 + n, 10)."""
    stiffness: FloatArray
    """(2,) infinite about an axis that is firm."""
    damping: FloatArray
    """(2,)."""
    moving: FloatArray
    """(3, 2) angles in the middle of the coming step, rates before it, their change in the last; written."""
    position: FloatArray
    """(2 + n,) scratch, as all that follows."""
    velocity: FloatArray
    turn: FloatArray
    """(2 + n, 2)."""
    mass: FloatArray
    """(2 + n, 2 + n)."""
    bias: FloatArray
    matrix: FloatArray
    right: FloatArray
    work: FloatArray
    """(2 + n, 22)."""


@compiled
def links_on_foot(
    foot: Foot,
    gravity: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    turn: FloatArray,
    mass: FloatArray,
    bias: FloatArray,
) -> None:
    """Mass matrix and bias of the links (n,) on their foot; written, those of the foot stay in it."""
    n, first = len(position), len(foot.stiffness)
    for a in range(first):
        foot.position[a] = foot.moving[ANGLE, a]
        foot.velocity[a] = foot.moving[RATE, a] + 0.5 * foot.moving[CHANGE, a]
        foot.turn[a, 0], foot.turn[a, 1] = math.cos(foot.position[a]), math.sin(foot.position[a])
    for i in range(n):
        foot.position[first + i], foot.velocity[first + i] = position[i], velocity[i]
        foot.turn[first + i, 0], foot.turn[first + i, 1] = turn[i, 0], turn[i, 1]
    mass_and_bias(
        foot.axes,
        foot.frames,
        foot.links,
        gravity,
        foot.position,
        foot.turn,
        foot.velocity,
        foot.mass,
        foot.bias,
        foot.work,
    )
    for i in range(n):
        bias[i] = foot.bias[first + i]
        for j in range(n):
            mass[i, j] = foot.mass[first + i, first + j]


@compiled
def without_foot(foot: Foot, mass: FloatArray, push: FloatArray, n: int, h: float) -> None:
    """Takes the foot's speeds out of the equations mass · change = push of the coordinates, in place."""
    first = len(foot.stiffness)
    size = first + n
    for i in range(size):
        foot.right[i] = 0.0
        for k in range(size):
            foot.matrix[i, k] = foot.mass[i, k] if i < first or k < first else 0.0
    for a in range(first):
        if math.isinf(foot.stiffness[a]):
            continue
        spring, damper = foot.stiffness[a], foot.damping[a]
        moment = foot.bias[a] + spring * foot.moving[ANGLE, a] + damper * foot.moving[RATE, a]
        foot.right[a] -= h * moment
        foot.matrix[a, a] += h * (0.5 * damper + 0.25 * h * spring)
        for i in range(a + 1, size):
            share = foot.matrix[i, a] / foot.matrix[a, a]
            foot.right[i] -= share * foot.right[a]
            for k in range(a, size):
                foot.matrix[i, k] -= share * foot.matrix[a, k]
    for i in range(n):
        push[i] += foot.right[first + i]
        for j in range(n):
            mass[i, j] += foot.matrix[first + i, first + j]


@compiled
def follow(foot: Foot, v: FloatArray, last: FloatArray, n: int, h: float) -> None:
    """Moves the foot through a step in which the joints' speeds went from ``last`` to ``v``."""
    first = len(foot.stiffness)
    for a in range(first - 1, -1, -1):
        change = 0.0
        if not math.isinf(foot.stiffness[a]):
            change = foot.right[a]
            for k in range(a + 1, first):
                change -= foot.matrix[a, k] * foot.moving[CHANGE, k]
            for j in range(n):
                change -= foot.matrix[a, first + j] * (v[j] - last[j])
            change /= foot.matrix[a, a]
        foot.moving[CHANGE, a] = change
        foot.moving[RATE, a] += change
        foot.moving[ANGLE, a] += h * foot.moving[RATE, a]
