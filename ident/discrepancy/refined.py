"""Parameters and shapes of effects with their standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ident.discrepancy.bounded import DEPENDENT
from ident.discrepancy.component import Component, at_point, inner, reach, shapes_of, values_of
from ident.discrepancy.deviations import deviations
from ident.discrepancy.examination import Examination
from ident.discrepancy.fitted import Fit, at_measured, fitted
from ident.discrepancy.gain_doubt import by_each_drive, scales_with_gains
from ident.discrepancy.solved import solve
from ident.effects.family import PlacedEffect, Shape
from ident.parameters.present import Present
from ident.statistics.symmetric import eigen_of
from robots.arrays import BoolArray, FloatArray

_DERIVATIVE = 0.01
"""Step of a numerical derivative over a shape, as a share of its value (or of its range where linear)."""

_DRAWS = 8
"""Present models, drawn from what is known of them, that say what their errors make of a finding."""


@dataclass(frozen=True)
class Refined:
    """Effects at their best shapes.

    Attributes:
        examination, components, present: the rows, the effects at these shapes, and the model that columns
            are made of.
        effects: with their shapes.
        linear: per effect, its linear parameters (p,).
        linear_sigma, shape_sigma: per effect, standard deviations.
        seen: per effect, which of its parameters the data show.
        size_sigma: per effect, deviation of a factor of all its parameters, its shapes as fitted; 0 where the
            data do not show it.
        as_simulated: whether sizes are those of simulations that have the effect as large.
    """

    examination: Examination = field(repr=False)
    components: tuple[Component, ...]
    present: Present = field(repr=False)
    effects: tuple[PlacedEffect, ...]
    linear: tuple[FloatArray, ...]
    linear_sigma: tuple[FloatArray, ...]
    shape_sigma: tuple[FloatArray, ...]
    seen: tuple[BoolArray, ...]
    size_sigma: tuple[float, ...]
    as_simulated: bool = False


def with_deviations(examination: Examination, components: Sequence[Component], present: Present) -> Refined:
    """Standard deviations from the columns and the derivatives over the shapes (Gauss–Newton)."""
    fit, shapes = fitted(examination, components, present), shapes_of(examination, components)
    parameters, own = fit.parameters, fit.own
    slopes, own_slopes = _slopes(examination, components, shapes, present, fit)
    matrix = np.concatenate([fit.columns, slopes], axis=1)
    whole = matrix if own is None else np.concatenate([own, own_slopes], axis=1)
    residual = left_beside(examination, fit)
    effects = tuple(component.effect(examination, present) for component in components)
    sigma = _of_noise(examination, effects, (matrix, whole, residual))
    sigma = np.hypot(sigma, _of_present(examination, components, present, fit, matrix))
    physical = [
        deviation * (value if shape.logarithmic else 1.0)
        for deviation, shape, value in zip(
            sigma[parameters.size :], shapes, values_of(components), strict=True
        )
    ]
    sigma = np.hypot(sigma, _of_gains(examination, effects, fit, matrix))
    starts = np.cumsum([len(component.shape) for component in components])[:-1]
    factors = fit.of_effects(parameters)
    per_shape = [
        beside_factor(effect, of_noise, factor)
        for effect, of_noise, factor in zip(
            effects, np.split(np.array(physical), starts), factors, strict=True
        )
    ]
    return Refined(
        examination,
        tuple(components),
        present,
        effects,
        factors,
        fit.of_effects(sigma),
        tuple(per_shape),
        tuple(factor > 0.0 for factor in fit.of_effects(np.linalg.norm(fit.columns, axis=0))),
        _of_sizes(examination, effects, factors, (matrix, whole, residual)),
    )


def _of_noise(
    examination: Examination,
    effects: Sequence[PlacedEffect],
    data: tuple[FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """Deviations (k,) that come of noise and misfit.

    Of an effect that its shapes alone make, factor and shapes share out one size. Without the effect no shape
    is left, so whether it is there is asked of the factor beside the shapes as fitted; and the shapes are
    what the factor of one that it has makes of them. Neither is unknown because the other could be anything.

    Args:
        examination: of the present model.
        effects: whose parameters come first, then all their shapes.
        data: columns, those whose factors they are, and the residual; as of :func:`deviations`.
    """
    matrix, whole, residual = data
    sigma = deviations(examination, matrix, whole, residual)
    factors = np.concatenate([np.full(len(one.parameters), one.whole) for one in effects])
    shapes = np.concatenate([np.full(len(one.shape), one.whole) for one in effects])
    for own, held in (
        (np.append(factors, 0 * shapes), np.append(0 * factors, shapes)),
        (np.append(0 * factors, shapes), np.append(factors, 0 * shapes)),
    ):
        if held.any():
            free = 1.0 - held
            beside = deviations(examination, matrix * free, whole * free, residual)
            sigma = np.where(own, beside, sigma)
    return sigma


def _of_sizes(
    examination: Examination,
    effects: Sequence[PlacedEffect],
    factors: Sequence[FloatArray],
    data: tuple[FloatArray, FloatArray, FloatArray],
) -> tuple[float, ...]:
    """Deviation of a factor of all parameters of each effect, its shapes as fitted; 0 where none shows it.

    Parameters that make much the same share out one size, and none of them is sure: a drive's friction that
    comes late by 2.1 ± 1.6 N·m and is higher at standstill by 0.6 ± 0.4 is there as a whole at 6 deviations.

    Args:
        examination: of the present model.
        effects: whose parameters come first, then all their shapes.
        factors: per effect, its parameters.
        data: as of :func:`_of_noise`.
    """
    matrix, whole, residual = data
    counts = [len(one) for one in factors]
    of = np.repeat(np.arange(len(effects)), counts)
    of = np.concatenate([of, np.repeat(np.arange(len(effects)), [len(one.shape) for one in effects])])
    found = []
    for number, values in enumerate(factors):
        start = sum(counts[:number])
        own = slice(start, start + values.size)
        beside = of != number
        one, measured = (
            np.column_stack([columns[:, own] @ values, columns[:, beside]]) for columns in (matrix, whole)
        )
        found.append(float(deviations(examination, one, measured, residual)[0]))
    return tuple(found)


def left_beside(examination: Examination, fit: Fit) -> FloatArray:
    """(N,) what the present model leaves beside fitted effects."""
    own = fit.columns if fit.own is None else examination.left_of(fit.own)
    return np.asarray(examination.residual - own @ fit.parameters)


def _of_present(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    fit: Fit,
    matrix: FloatArray,
) -> FloatArray:
    """Deviations (k,) that come of what is not known of the present model: the columns are made of it.

    Links that are known to a tenth make the error of a gear that moves them known to a tenth. In closed loop
    each draw would be a simulation of every effect, and none is made.

    Args:
        examination, components, present: as in :func:`ident.discrepancy.refine.refit`.
        fit: at the present model.
        matrix: (N, k) columns and slopes, whose factors deviate.
    """
    if examination.simulated:
        return np.zeros(matrix.shape[1])
    base, beta = examination.base, examination.beta
    values, vectors = eigen_of(examination.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    known = base.standard_from(beta, base.model.prior())
    changes = np.zeros((_DRAWS, fit.columns.shape[0]))
    draws = np.random.default_rng(0).standard_normal((_DRAWS, beta.size))
    for change, draw in zip(changes, draws, strict=True):
        moved = base.standard_from(beta + root @ draw, base.model.prior()) - known
        standard = present.standard.copy()
        standard[: moved.size] += moved
        other = Present(present.model, standard)
        solved = solve(examination, components, other, fit.parameters)
        if solved is not None:
            change[:] = (solved[2] - fit.columns) @ fit.parameters
        if not change.any():
            break  # a body that was added is the same on any arm
    size = np.linalg.norm(matrix, axis=0)
    seen = size > 0.0  # not a shape that is tried, but not fitted
    sigma = np.zeros(size.size)
    shifts = np.linalg.lstsq(matrix[:, seen] / size[seen], changes.T, rcond=np.sqrt(DEPENDENT))[0]
    sigma[seen] = np.sqrt(np.mean(shifts**2, axis=1)) / size[seen]
    return sigma


def _of_gains(
    examination: Examination, effects: Sequence[PlacedEffect], fit: Fit, matrix: FloatArray
) -> FloatArray:
    """Deviations (k,) that come of the drives' gains, against a prior: see :mod:`.gain_doubt`.

    Args:
        examination: of the present model.
        effects: that were fitted.
        fit: of them.
        matrix: (N, k) columns and slopes, whose factors deviate.
    """
    variance = np.zeros(matrix.shape[1])
    if examination.prior is None or examination.simulated:
        return variance
    size = np.linalg.norm(matrix, axis=0)
    seen = size > 0.0
    scaled = matrix[:, seen] / size[seen]
    robot, cuts = examination.base.model.robot, np.cumsum([piece.rows for piece in examination.prepared])[:-1]
    for effect, factors in zip(effects, fit.of_effects(fit.parameters), strict=True):
        if not scales_with_gains(effect):
            continue
        torque = np.concatenate([piece.columns_of(effect) @ factors for piece in examination.prepared])
        for off in by_each_drive(robot, torque):
            white = examination.whiten(np.split(off[:, :, np.newaxis], cuts))
            shift = np.linalg.lstsq(scaled, white[:, 0], rcond=np.sqrt(DEPENDENT))[0]
            variance[seen] += (shift / size[seen]) ** 2
    return np.asarray(np.sqrt(variance))


def _slopes(
    examination: Examination,
    components: Sequence[Component],
    shapes: Sequence[Shape],
    present: Present,
    fit: Fit,
) -> tuple[FloatArray, FloatArray]:
    """(N, s) derivatives over the shapes of what the effects make, at the instruments and as measured."""
    point = np.array([inner(s, v) for s, v in zip(shapes, values_of(components), strict=True)])
    slopes = np.zeros((2, fit.columns.shape[0], len(shapes)))
    for k, shape in enumerate(shapes):
        if shape.fixed:
            continue
        step = _DERIVATIVE * (1.0 if shape.logarithmic else reach(shape))
        if point[k] + step > inner(shape, shape.upper):
            step = -step
        moved = point.copy()
        moved[k] += step
        there = at_point(components, shapes, moved)
        other = solve(examination, there, present, fit.parameters)
        if other is not None:
            slopes[0, :, k] = (other[2] - fit.columns) @ fit.parameters / step
        beside = None if fit.own is None else at_measured(examination, there, present)
        if fit.own is not None and beside is not None:
            slopes[1, :, k] = (beside - fit.own) @ fit.parameters / step
    return slopes[0], slopes[1]


def beside_factor(effect: PlacedEffect, deviations: FloatArray, factor: FloatArray) -> FloatArray:
    """Deviations of an effect's shape (s,), with what its factor says of the form being not quite that.

    Noise is the least of it where the form is wrong: a stiffness that goes with a factor of 0.8 is known to a
    fifth, however clearly the data prefer it to any other.
    """
    if not effect.whole or not factor.size:
        return deviations
    sizes = np.abs(np.array(effect.shape))
    wrong = np.hypot(deviations, sizes * (1.0 - float(factor[0])))
    return np.asarray(np.where(deviations > 0.0, wrong, deviations))
