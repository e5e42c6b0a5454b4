"""Effects that were found, fitted together: shapes, parameters, and their standard deviations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.component import Component
from ident.discrepancy.examination import Examination
from ident.discrepancy.fitted import fitted
from ident.discrepancy.refined import Refined, with_deviations
from ident.discrepancy.shape_search import best_shapes
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray

_ROUNDS = 2
"""Of fitting what was found once more, each effect beside the torque of the others at their sizes."""

_EVALUATIONS = 8
"""Per shape, of each round."""

_SURE = 5.0
"""Standard deviations by which a parameter differs from zero to be simulated."""


def refit(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    about: Present | None = None,
) -> Refined:
    """Fit some effects together once more, each beside all the others.

    Columns that ask the model for its torques are made of the model with everything that is found: friction
    of a load is that of the payload, too. Those of a closed loop hold at the sizes they were simulated with.

    Args:
        examination: of the model without any of them.
        components: at about their shapes.
        present: that model.
        about: the model with all of them, where another fit has it. (Links that have taken up a gear which
            rings put its resonance beside the arm's, and with such columns nothing was left of 680 N·m.)
    """
    best, alone = list(components), present
    for _ in range(0 if examination.simulated else _ROUNDS):
        if about is None:
            present = _beside(examination, best, present, alone)
        else:
            present, about = about, None
        best = best_shapes(examination, best, present, 0.1, _EVALUATIONS)
    return with_deviations(examination, best, present)


def _beside(
    examination: Examination, components: Sequence[Component], present: Present, alone: Present
) -> Present:
    """The model with the effects at their fitted sizes, and without what its parameters had taken up of them.

    They were fitted without them: a ripple of a gear makes the links behind it look lighter, and a column of
    lighter links finds a larger ripple. In the model they are made of it alone: of one that has them already
    a delay would ask twice as often with every round.
    """
    fit = fitted(examination, components, present)
    effects = [component.effect(examination, present) for component in components]
    values = fit.of_effects(fit.parameters)
    torque = sum(
        np.concatenate([piece.columns_of(effect) for piece in examination.prepared]) @ size
        for effect, size in zip(effects, values, strict=True)
    )
    white = examination.whiten([np.asarray(torque)[:, :, np.newaxis]])
    beta = examination.beta - examination.taken_up(white)[:, 0]
    base = examination.base
    standard = base.standard_from(beta, base.model.prior())
    return with_effects(examination, components, alone, standard, values)


def with_effects(
    examination: Examination,
    components: Sequence[Component],
    alone: Present,
    standard: FloatArray,
    values: Sequence[FloatArray],
) -> Present:
    """A model with effects of given sizes.

    Args:
        examination: of the model without them.
        components: with their shapes.
        alone: that model, which the effects in it are made of.
        standard: (p,) its parameters.
        values: of each effect, its parameters.
    """
    model = examination.base.model
    effects = [component.effect(examination, alone) for component in components]
    giving = [pair for pair in zip(effects, values, strict=True) if pair[0].gives_way]
    if giving:  # all at once, and beside them what follows the torque through a gear
        with_them = RegressorModel(model.robot, (*alone.model.effects, *(effect for effect, _ in giving)))
        present = Present(with_them, np.concatenate([alone.standard, *(size for _, size in giving)]))
        effects = [component.effect(examination, present) for component in components]
    whole = RegressorModel(model.robot, (*model.effects, *effects))
    return Present(whole, np.concatenate([standard, *values]))


def added_values(refined: Refined) -> list[FloatArray]:
    """Per effect, the parameters that it enters the model with: those that the data show, within bounds."""
    found = []
    parts = zip(refined.effects, refined.linear, refined.linear_sigma, refined.seen, strict=True)
    for effect, values, sigma, seen in parts:
        lowest, highest = np.array(effect.bounds).T
        # One that is hardly determined was found by a small step, and may be far off where it is not small.
        sure = np.abs(values) >= _SURE * sigma
        # What was named is there, though how it divides up is not sure.
        sure |= refined.as_simulated or not sure.any()
        found.append(np.where(sure, np.clip(values, lowest, highest), 0.0)[seen])
    return found
