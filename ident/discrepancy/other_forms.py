"""What the sizes of a found effect owe to a form that the data hardly choose.

Friction falls with speed as Tustin has it or as Gauss has it. Where the motion shows next to nothing of rest
both fit, and their sizes at rest differ by a factor of two: a deviation that takes one form for certain does
not hold. Over forms that are as likely before the data the variance is that of their mixture about the value
that is given, Σ p (σ² + (θ − θ̂)²) (Hoeting and others 1999).

How likely a form is follows from its squares; but those of neighbouring rows go together where what a finding
leaves is misfit. So the log likelihood ratio is divided by how much more the difference of squares varies
between blocks of time than it would on white rows (a quasi-likelihood, Wedderburn 1974; its variance: Vuong
1989).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ident.discrepancy.component import Component
from ident.discrepancy.deviations import blocks_of
from ident.discrepancy.examination import Examination
from ident.discrepancy.fitted import fitted
from ident.discrepancy.refined import Refined, left_beside, with_deviations
from ident.discrepancy.shape_search import best_shapes
from robots.arrays import FloatArray

_WIDTH, _EVALUATIONS = 0.5, 16
"""Of the search for a form's other shapes: first steps of the grid, and evaluations per shape."""

_LEAST = 1e-3
"""Likelihood over that of the best form below which a form changes no deviation that is seen."""


def of_other_forms(refined: Refined, number: int) -> FloatArray:
    """(p + s,) what other forms of an effect make of the deviations of its parameters and shapes.

    A form is a value of a shape that takes a few alone. In closed loop each would be a search by simulations,
    and none is tried.

    Args:
        refined: effects at their best shapes.
        number: of the effect.
    """
    own, others = refined.effects[number], _likely_forms(refined, number)
    if not others:
        return np.zeros(len(own.parameters) + len(own.shape))
    shares = np.array([1.0, *(weight for weight, _ in others)])
    fits = [refined, *(other for _, other in others)]
    of_shapes = beyond(
        shares,
        [np.array(one.effects[number].shape) for one in fits],
        [one.shape_sigma[number] for one in fits],
    )
    # A form itself is one of a few: it has no deviation.
    free = [not shape.fixed for shape in refined.components[number].shapes(refined.examination)]
    return np.concatenate([of_sizes(number, refined, others), np.where(free, of_shapes, 0.0)])


def _likely_forms(refined: Refined, number: int) -> list[tuple[float, Refined]]:
    """Likelihood over that of the best form, and the fit, of each other form that deviations see."""
    examination, components, present = refined.examination, refined.components, refined.present
    forms = [] if examination.simulated else list(_forms(examination, components, number))
    if not forms:
        return []
    found, best = [], left_beside(examination, fitted(examination, components, present))
    for form in forms:
        shaped = best_shapes(examination, form, present, _WIDTH, _EVALUATIONS, of=[number])
        try:
            left = left_beside(examination, fitted(examination, shaped, present))
        except ArithmeticError:
            continue  # the present model explains all that this form does
        weight = likelihood(left, best, examination)
        if weight > _LEAST:
            found.append((weight, with_deviations(examination, shaped, present)))
    return found


def of_sizes(number: int, refined: Refined, others: Sequence[tuple[float, Refined]]) -> FloatArray:
    """(p,) what other forms of one effect make of its parameters' deviations.

    A form that rows hardly show leaves its parameters at what they were before any data; one with other
    parameters (a share of the torque instead of a torque) says nothing of these.
    """
    names = [parameter.name for parameter in refined.effects[number].parameters]
    shares, values, sigma = [1.0], [refined.linear[number]], [refined.linear_sigma[number]]
    for weight, one in others:
        effect = one.effects[number]
        if [parameter.name for parameter in effect.parameters] == names:
            scale, centre = np.array(effect.scale), np.array(effect.centre)
            known = scale**2 / (scale**2 + one.linear_sigma[number] ** 2)
            shares.append(weight)
            values.append(centre + known * (one.linear[number] - centre))
            sigma.append(one.linear_sigma[number] * np.sqrt(known))
    return beyond(np.array(shares), values, sigma)


def _forms(
    examination: Examination, components: Sequence[Component], number: int
) -> Iterator[list[Component]]:
    """An effect with each other value of each of its forms, the others as they are."""
    one = components[number]
    for index, shape in enumerate(one.shapes(examination)):
        for value in shape.grid if shape.fixed else ():
            if value != one.shape[index]:
                moved = (*one.shape[:index], value, *one.shape[index + 1 :])
                changed = Component(one.family, one.place, moved)
                yield [*components[:number], changed, *components[number + 1 :]]


def likelihood(left: FloatArray, best: FloatArray, examination: Examination) -> float:
    """Of what a form leaves over that of what the best one leaves, each (N,) whitened.

    Args:
        left, best: residuals.
        examination: whose rows these are.
    """
    difference, apart = left**2 - best**2, left - best
    white = 4.0 * float(apart @ apart)
    if white == 0.0:
        return 1.0
    labels = blocks_of(examination)
    sums = np.bincount(labels, difference[: labels.size])
    between = float(sums.size * np.var(sums, ddof=1)) if sums.size > 1 else 0.0
    freedom = max(1, best.size - examination.base.independent.size)
    excess = max(1.0, float(best @ best) / freedom, between / white)
    return float(np.exp(min(0.0, -0.5 * difference.sum() / excess)))


def beyond(shares: FloatArray, values: Sequence[FloatArray], sigma: Sequence[FloatArray]) -> FloatArray:
    """(k,) what a mixture varies by about its first values, beyond the first deviations.

    Args:
        shares: of each, any scale.
        values, sigma: of each, (k,).
    """
    away = np.array(values) - values[0]
    variance = shares / shares.sum() @ (np.array(sigma) ** 2 + away**2)
    return np.asarray(np.sqrt(np.maximum(variance - sigma[0] ** 2, 0.0)))
