"""The way over which a drive's dry friction builds up after a reversal, as recordings show it."""

from __future__ import annotations

import numpy as np

from ident.base import BaseParameters
from ident.discrepancy.loop import FINE, Loop
from ident.discrepancy.loop_parts import simulated_parts
from robots.arrays import FloatArray

_LENGTHS = (2e-6, 1e-5, 5e-5, 2.5e-4)
"""rad (or m) over which dry friction builds up in gears that are sound."""
_FLAT = 1e-6
"""A bend of a logarithm of losses that tells nothing."""
_NEARER = (1.8, 1.25)
"""Steps, nearer and nearer, of the points beside the best one so far."""


def presliding(loop: Loop, base: BaseParameters, beta: FloatArray) -> FloatArray:
    """(n,) the pre-sliding way that goes best with the recordings, one for all drives.

    A drive whose friction builds up more slowly than that of the others is a finding: it has no way of its
    own here, and the median is not moved by it. Drives count by how surely they tell their way.

    Raises:
        IdentificationError: the loop cannot be simulated with these parameters.
    """
    standard = base.standard_from(beta, base.model.prior())
    grid, measured = np.array(_LENGTHS), loop.measured()
    for step in (*_NEARER, 1.0):
        losses = []
        for length in grid:
            parts = simulated_parts(loop, base, standard, np.full(loop.robot.n, length))
            left = measured - loop.torque(loop.run(parts, FINE))
            losses.append(np.sum(left**2, axis=0))
        best = [_lowest(np.log(grid), np.log(loss)) for loss in np.array(losses).T]
        points, weights = np.array(best).T
        length = float(np.exp(np.quantile(points, 0.5, weights=weights, method="inverted_cdf")))
        grid = length * np.array([1.0 / step, 1.0, step])
    return np.full(loop.robot.n, length)


def _lowest(points: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Where the parabola through the lowest value and its neighbours is lowest, and how sharply it bends.

    The bend is that of a log likelihood: its root goes as one over the standard deviation of the place.
    """
    k = int(np.clip(np.argmin(values), 1, points.size - 2))
    curve = np.polyfit(points[k - 1 : k + 2], values[k - 1 : k + 2], 2)
    if curve[0] <= _FLAT:
        return float(points[int(np.argmin(values))]), float(np.sqrt(_FLAT))
    return float(np.clip(-0.5 * curve[1] / curve[0], points[0], points[-1])), float(np.sqrt(curve[0]))
