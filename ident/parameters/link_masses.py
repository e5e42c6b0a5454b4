"""Mass matrices of the links along a motion, in machine code."""

from __future__ import annotations

import numpy as np

from ident.kernels.compilation import making_arrays
from ident.kernels.rigid_bodies import mass_and_bias
from ident.kernels.values import Axes
from robots.arrays import FloatArray


@making_arrays
def masses_along(
    axes: Axes, frames: FloatArray, links: FloatArray, position: FloatArray, masses: FloatArray
) -> None:
    """M(q) at each sample, in place.

    Args:
        axes: of n.
        frames: as of ``chain_frames``.
        links: (n, 10) standard parameters.
        position: samples × n.
        masses: samples × n × n, written.
    """
    n = len(axes)
    bias, work, turn = np.empty(n), np.empty((n, 22)), np.empty((n, 2))
    still, weightless = np.zeros(n), np.zeros(3)
    for k in range(position.shape[0]):
        for i in range(n):
            turn[i, 0], turn[i, 1] = np.cos(position[k, i]), np.sin(position[k, i])
        mass_and_bias(axes, frames, links, weightless, position[k], turn, still, masses[k], bias, work)
