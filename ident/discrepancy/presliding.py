"""How the dry friction of the drives turns its sign at standstill, as recordings show it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.loop import FINE, Loop, Standstill
from ident.discrepancy.loop_parts import simulated_parts
from ident.effects import FrictionSign
from ident.effects.simulated import Bristle
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray

_LENGTHS = (2e-6, 1e-5, 5e-5, 2.5e-4)
"""rad (or m) over which dry friction builds up in gears that are sound."""
_WIDTHS = (5e-4, 2e-3, 8e-3, 3.2e-2)
"""rad/s (or m/s) over which dry friction that is a smooth function of the speed turns its sign."""
_FLAT = 1e-6
"""A bend of a logarithm of losses that tells nothing."""
_NEARER = (1.8, 1.25)
"""Steps, nearer and nearer, of the points beside the best one so far."""
_NEAREST = 1.06
"""The last one: a loss is no parabola over more. (With 1.25 the width came out 5 % too large on a clean
foreign arm, and what friction then lacked was a static friction of two drives with 180 nats.)"""

Law = Bristle | FrictionSign


def standstill_of(loop: Loop, base: BaseParameters, beta: FloatArray, each: bool = False) -> Standstill:
    """What goes best with the recordings: bristles that bend over a way, or friction smoothed over a speed.

    One size for all drives, unless each is to have its own. A drive whose friction builds up more slowly than
    that of the others is a finding: it has no size of its own here, and the median is not moved by it. Drives
    count by how surely they tell theirs. Of the two laws the likelier is taken, each drive with a noise of
    its own: Σ log loss.

    Raises:
        IdentificationError: the loop cannot be simulated with these parameters.
    """
    standard = base.standard_from(beta, base.model.prior())
    measured, drives = loop.measured(), loop.robot.n

    def losses(standstill: Standstill) -> FloatArray:
        parts = simulated_parts(loop, base, standard, standstill)
        return np.asarray(np.sum((measured - loop.torque(loop.run(parts, FINE))) ** 2, axis=0))

    found = []
    for law, grid in ((_bristles, _LENGTHS), (_smoothed, _WIDTHS)):
        grids = np.tile(np.array(grid)[:, np.newaxis], drives)
        for step in (*_NEARER, _NEAREST):
            sizes = _best(losses, law, grids, each)
            grids = sizes * np.array([1.0 / step, 1.0, step])[:, np.newaxis]
        found.append((float(np.log(losses(_laws(law, sizes))).sum()), law, grids))
    _, law, grids = min(found, key=lambda one: one[0])
    return _laws(law, _best(losses, law, grids, each))


def _bristles(length: float) -> Law:
    return Bristle(length, "exponential")


def _smoothed(width: float) -> Law:
    return FrictionSign("tanh", width)


def _laws(law: Callable[[float], Law], sizes: FloatArray) -> Standstill:
    return tuple(law(float(size)) for size in sizes)


def _best(
    losses: Callable[[Standstill], FloatArray], law: Callable[[float], Law], grids: FloatArray, each: bool
) -> FloatArray:
    """(n,) the size at which a law goes best with each drive, by a parabola through points of its grid.

    Args:
        losses: (n,) of a standstill.
        law: of a size.
        grids: sizes × n.
        each: whether drives may differ; else all have the median, weighted.
    """
    found = np.array(at_once(losses, [_laws(law, sizes) for sizes in grids]))
    pairs = [_lowest(np.log(grid), np.log(loss)) for grid, loss in zip(grids.T, found.T, strict=True)]
    points, weights = np.array(pairs).T
    if not each:
        points[:] = np.quantile(points, 0.5, weights=weights, method="inverted_cdf")
    return np.asarray(np.exp(points))


def _lowest(points: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Where the parabola through the lowest value and its neighbours is lowest, and how sharply it bends.

    The bend is that of a log likelihood: its root goes as one over the standard deviation of the place.
    """
    k = int(np.clip(np.argmin(values), 1, points.size - 2))
    curve = np.polyfit(points[k - 1 : k + 2], values[k - 1 : k + 2], 2)
    if curve[0] <= _FLAT:
        return float(points[int(np.argmin(values))]), float(np.sqrt(_FLAT))
    return float(np.clip(-0.5 * curve[1] / curve[0], points[0], points[-1])), float(np.sqrt(curve[0]))
