"""From the grid to the best shape, and from there to parameters with their standard deviations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.component import Component
from ident.discrepancy.examination import Examination
from ident.discrepancy.fitted import fitted
from ident.discrepancy.library import effect_rows
from ident.discrepancy.present import Present
from ident.discrepancy.refined import Refined, with_deviations
from ident.discrepancy.shape_search import best_shapes
from robots.arrays import FloatArray

_EVALUATIONS, _AGAIN = 40, 8
"""Evaluations per shape: of the search, and once what the present model had taken up is given back."""

_SURE = 5.0
"""Standard deviations by which a parameter differs from zero to be simulated."""


def refine(examination: Examination, components: Sequence[Component], present: Present) -> Refined:
    """Fit shapes and linear parameters of some effects together.

    Args:
        examination: the present model on the recordings.
        components: effects with the shapes that the grid gave.
        present: the present model, for effects that ask it for torques.
    """
    best = best_shapes(examination, components, present, 0.5, _EVALUATIONS)
    if examination.loop is None:
        present = _beside(examination, best, present)
        best = best_shapes(examination, best, present, 0.1, _AGAIN)
    return with_deviations(examination, best, present)


def _beside(examination: Examination, components: Sequence[Component], present: Present) -> Present:
    """The present model without what its parameters had taken up of the effects.

    They were fitted without them: a ripple of a gear makes the links behind it look lighter, and a column of
    lighter links finds a larger ripple.
    """
    fit = fitted(examination, components, present)
    effects = [component.effect(examination, present) for component in components]
    torque = sum(
        np.concatenate([effect_rows(scene, effect) for scene in examination.scenes]) @ values
        for effect, values in zip(effects, fit.of_effects(fit.parameters), strict=True)
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
