"""How the dry friction of the drives turns its sign at standstill, as recordings show it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.existing_arm import existing
from ident.discrepancy.loop import FINE, Loop, Standstill
from ident.discrepancy.loop_parts import simulated_parts
from ident.effects import FrictionSign
from ident.effects.simulated import Bristle, SoftConstraint
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot

_LENGTHS = (2e-6, 1e-5, 5e-5, 2.5e-4)
"""rad (or m) over which dry friction builds up in gears that are sound."""
_WIDTHS = (5e-4, 2e-3, 8e-3, 3.2e-2)
"""rad/s (or m/s) over which dry friction that is a smooth function of the speed turns its sign."""
_TIMES = (2.4e-3, 9.5e-3, 3.8e-2)
"""s in which friction that is the force of a soft constraint brings its drive to rest; MuJoCo's is 9.5 ms."""
_QUICKER = np.array([1.0 / 16.0, 1.0 / 4.0])
"""Of the least size of a law's grid: what is tried, too, where that one goes best."""
_GIVES = 1.0 / 9.0
"""(1 − d)/d with MuJoCo's impedance d = 0.9: what such friction falls short by, over what it makes."""
_FLAT = 1e-6
"""A bend of a logarithm of losses that tells nothing."""
_NEAR = 1.8
"""Step of the points beside the best one of a law's grid, by which laws are compared."""
_NEAREST = 1.06
"""The last one: a loss is no parabola over more. (With 1.25 the width came out 5 % too large on a clean
foreign arm, and what friction then lacked was a static friction of two drives with 180 nats.)"""
_NEARER = (1.25, _NEAREST)
"""Of the likeliest law, nearer and nearer."""

OfSizes = Callable[[FloatArray], Standstill]
"""How dry friction turns its sign in each drive, by a size (n,) of each."""


def standstill_of(loop: Loop, base: BaseParameters, beta: FloatArray, each: bool = False) -> Standstill:
    """What goes best with the recordings: bristles that bend over a way, friction smoothed over a speed, or
    that of a soft constraint.

    One size for all drives, unless each is to have its own. A drive whose friction builds up more slowly than
    that of the others is a finding: it has no size of its own here, and the median is not moved by it. Drives
    count by how surely they tell theirs. Of the laws the likeliest is taken, each drive with a noise of its
    own: Σ log loss.

    Raises:
        IdentificationError: the loop cannot be simulated with these parameters.
    """
    standard = base.standard_from(beta, base.model.prior())
    standard = existing(
        base.model, standard, np.concatenate([one.recording.position for one in loop.prepared])
    )
    measured, drives = loop.measured(), loop.robot.n
    known: dict[Standstill, FloatArray] = {}

    def losses(standstill: Standstill) -> FloatArray:
        if standstill not in known:  # laws are compared at the middle of the grid that comes next
            parts = simulated_parts(loop, base, standard, standstill)
            left = measured - loop.torque(loop.run(parts, FINE))
            known[standstill] = np.asarray(np.sum(left**2, axis=0))
        return known[standstill]

    laws: list[tuple[OfSizes, tuple[float, ...]]] = [(_bristles, _LENGTHS), (_smoothed, _WIDTHS)]
    rates = stopping_rates(base.model, standard)
    if rates is not None:
        laws.append((lambda times: constraints(rates, times), _TIMES))

    def likeliest(one: tuple[OfSizes, tuple[float, ...]]) -> tuple[float, OfSizes, FloatArray]:
        law, grid = one
        tried = np.tile(np.array(grid)[:, np.newaxis], drives)
        sizes = _best(losses, law, tried, each)
        if (sizes < _NEAREST * tried[0]).any():
            sizes = _best(losses, law, np.concatenate([tried[0] * _QUICKER[:, np.newaxis], tried[:2]]), each)
        sizes = _best(losses, law, _about(sizes, _NEAR), each)
        return float(np.log(losses(law(sizes))).sum()), law, sizes

    _, law, sizes = min(at_once(likeliest, laws), key=lambda one: one[0])
    for step in _NEARER:
        sizes = _best(losses, law, _about(sizes, step), each)
    if rates is None or law is not laws[-1][0]:
        return law(sizes)
    return _with_widths(losses, law(sizes))


def _with_widths(losses: Callable[[Standstill], FloatArray], found: Standstill) -> Standstill:
    """Soft constraints whose widths are each drive's own: how far one gives way follows the posture, too."""

    def of_widths(widths: FloatArray) -> Standstill:
        pairs = zip(found, widths, strict=True)
        return tuple(replace(one, width=float(width)) for one, width in pairs)  # type: ignore[arg-type]

    widths = np.array([one.width for one in found if isinstance(one, SoftConstraint)])
    for step in _NEARER:
        widths = _best(losses, of_widths, _about(widths, step), each=True)
    return of_widths(widths)


def _about(sizes: FloatArray, step: float) -> FloatArray:
    """(3, n) sizes with a step to either side."""
    return np.asarray(sizes * np.array([1.0 / step, 1.0, step])[:, np.newaxis])


def usual_standstill(robot: Robot) -> Standstill:
    """Of gears that are sound, before a recording has shown it."""
    return _bristles(np.full(robot.n, _LENGTHS[1]))


def _bristles(lengths: FloatArray) -> Standstill:
    return tuple(Bristle(float(length), "exponential") for length in lengths)


def _smoothed(widths: FloatArray) -> Standstill:
    return tuple(FrictionSign("tanh", float(width)) for width in widths)


def constraints(rates: FloatArray, times: FloatArray) -> Standstill:
    """Friction as soft constraints.

    Args:
        rates: (n,) of each drive, as of :func:`stopping_rates`.
        times: (n,) s, in which each comes to rest.
    """
    pairs = zip(rates, times, strict=True)
    return tuple(SoftConstraint(float(_GIVES * rate * time), float(time)) for rate, time in pairs)


def stopping_rates(model: RegressorModel, standard: FloatArray) -> FloatArray | None:
    """(n,) rad/s² (or m/s²) by which its own dry friction slows each drive down, the arm at zero.

    Args:
        model: with the terms that are found.
        standard: (p,) its parameters.

    Returns:
        None where a drive has no dry friction, or the arm at zero no inertia that an arm can have.
    """
    robot = model.robot
    friction, inertia = (_of_drives(model, standard, symbol) for symbol in ("Fc", "Ia"))
    matrix, links = robot.transmission_matrix, Present(model, standard)
    mass = links.link_mass_matrix(np.zeros((1, robot.n)))[0] + matrix.T @ np.diag(inertia) @ matrix
    if not (np.linalg.eigvalsh(mass) > 0.0).all() or not (friction > 0.0).all():
        return None
    return np.asarray(friction * np.diag(matrix @ np.linalg.inv(mass) @ matrix.T))


def _of_drives(model: RegressorModel, standard: FloatArray, symbol: str) -> FloatArray:
    """(n,) one parameter of each drive; zero where the model has none."""
    values = np.zeros(model.robot.n)
    for effect, own in model.columns_of_effects:
        for parameter, value in zip(effect.parameters, standard[own], strict=True):
            if parameter.symbol == symbol:
                values[parameter.place.joints[0]] += value
    return values


def _best(
    losses: Callable[[Standstill], FloatArray], law: OfSizes, grids: FloatArray, each: bool
) -> FloatArray:
    """(n,) the size at which a law goes best with each drive, by a parabola through points of its grid.

    Args:
        losses: (n,) of a standstill.
        law: of a size of each drive.
        grids: sizes × n.
        each: whether drives may differ; else all have the median, weighted.
    """
    found = np.array(at_once(losses, [law(sizes) for sizes in grids]))
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
