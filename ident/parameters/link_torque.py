"""Torque and mass matrix of the links along a motion, in machine code: effects often ask for them."""

from __future__ import annotations

import numpy as np

from ident.kernels.compilation import compiled
from ident.kernels.rigid_bodies import mass_and_bias
from ident.kernels.values import Axes
from robots.arrays import FloatArray


@compiled
def along_motion(
    axes: Axes,
    frames: FloatArray,
    links: FloatArray,
    gravity: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    torque: FloatArray,
    masses: FloatArray,
) -> None:
    """τ = M(q) q̈ + N(q, q̇) and M(q) at each sample, in place.

    Args:
        axes: of n.
        frames: as of ``chain_frames``.
        links: (n, 10) standard parameters.
        gravity: (3,) m/s².
        position, velocity, acceleration: samples × n.
        torque: samples × n, written; masses: samples × n × n, written.
    """
    n = len(axes)
    mass, bias, work, turn = np.empty((n, n)), np.empty(n), np.empty((n, 22)), np.empty((n, 2))
    for k in range(position.shape[0]):
        for i in range(n):
            turn[i, 0], turn[i, 1] = np.cos(position[k, i]), np.sin(position[k, i])
        mass_and_bias(axes, frames, links, gravity, position[k], turn, velocity[k], mass, bias, work)
        for i in range(n):
            total = bias[i]
            for j in range(n):
                total += mass[i, j] * acceleration[k, j]
                masses[k, i, j] = mass[i, j]
            torque[k, i] = total
