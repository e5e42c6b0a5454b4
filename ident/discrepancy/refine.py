"""From the grid to the best shape, and from there to parameters with their standard deviations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.component import Component, at_point, inner, shapes_of, values_of
from ident.discrepancy.examination import Examination
from ident.discrepancy.library import effect_rows
from ident.discrepancy.present import Present
from ident.discrepancy.refined import Refined, with_deviations
from ident.discrepancy.shape_search import ShapeSearch
from robots.arrays import FloatArray

_EVALUATIONS = 40
_SIMULATED = 10
"""Evaluations per shape: of the search, and of its end by simulation of the loop."""

_AGAIN = 8
"""The same once what the present model had taken up of the effects is given back."""

_SURE = 5.0
"""Standard deviations by which a parameter differs from zero to be simulated."""


def refine(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    evaluations: int = _EVALUATIONS,
    exact: bool = True,
) -> Refined:
    """Fit shapes and linear parameters of some effects together.

    Args:
        examination: the present model on the recordings.
        components: effects with the shapes that the grid gave.
        present: the present model, for effects that ask it for torques.
        evaluations: of the search, per shape.
        exact: in closed loop, by simulation of the effects; else about.
    """
    best = _best_shapes(examination, components, present, 0.5, evaluations, exact)
    refined = with_deviations(examination, best, present, exact)
    if exact and examination.loop is None:
        beside = _beside(examination, refined, present)
        best = _best_shapes(examination, best, beside, 0.1, _AGAIN, exact)
        refined = with_deviations(examination, best, beside, exact)
    return refined


def _best_shapes(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    width: float,
    evaluations: int,
    exact: bool,
) -> list[Component]:
    """The components at the shapes that take most off the residual."""
    shapes = shapes_of(examination, components)
    if all(shape.fixed for shape in shapes):
        return list(components)
    search = ShapeSearch(examination, components, shapes, present)
    start = np.array([inner(s, v) for s, v in zip(shapes, values_of(components), strict=True)])
    in_loop = exact and examination.loop is not None
    point = search.best(start, width, evaluations, exact=exact and not in_loop)
    if in_loop:
        # What a loop answers about finds the region; of that the simulation takes the best point.
        starts = [*search.other_forms(point), *search.other_forms(start)]
        losses = [search.loss(one, True) for one in starts]
        nearest = starts[int(np.argmin(losses))]
        point = search.best(nearest, 0.25, _SIMULATED, exact=True)
    return at_point(components, shapes, point)


def _beside(examination: Examination, refined: Refined, present: Present) -> Present:
    """The present model without what its parameters had taken up of the effects.

    They were fitted without them: a ripple of a gear makes the links behind it look lighter, and a column of
    lighter links finds a larger ripple.
    """
    torque = sum(
        np.concatenate([effect_rows(scene, effect) for scene in examination.scenes]) @ values
        for effect, values in zip(refined.effects, refined.linear, strict=True)
    )
    white = examination.whiten([np.asarray(torque)[:, :, np.newaxis]])
    beta = examination.beta - examination.taken_up(white)[:, 0]
    base = examination.base
    return Present(present.model, base.standard_from(beta, base.model.prior()))


def added_values(refined: Refined) -> list[FloatArray]:
    """Per effect, the parameters that it enters the model with: those that the data show, within bounds."""
    found = []
    parts = zip(refined.effects, refined.linear, refined.linear_sigma, refined.seen, strict=True)
    for effect, values, sigma, seen in parts:
        lowest, highest = np.array(effect.bounds).T
        # One that is hardly determined was found by a small step, and may be far off where it is not small.
        sure = np.abs(values) >= _SURE * sigma
        sure |= not sure.any()  # What was named is there, though how it divides up is not sure.
        found.append(np.where(sure, np.clip(values, lowest, highest), 0.0)[seen])
    return found
