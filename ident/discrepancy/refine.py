"""From the grid to the best shape, and from there to parameters with their standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import minimize

from ident.discrepancy.bounded import DEPENDENT, within_bounds
from ident.discrepancy.deviations import deviations, instrumented
from ident.discrepancy.examination import Examination
from ident.discrepancy.library import Trial, effect_rows, partialled
from ident.discrepancy.loop import FINE, bristled
from ident.discrepancy.present import Present
from ident.effects.family import EffectFamily, Place, PlacedEffect, Shape
from robots.arrays import BoolArray, FloatArray

_EVALUATIONS = 40
_SIMULATED = 10
"""Evaluations per shape: of the search, and of its end by simulation of the loop."""

_AGAIN = 8
"""The same once what the present model had taken up of the effects is given back."""

_FACTOR_OF_ONE = ("joint_elasticity", "backlash")
"""Effects whose size is in their shape, so that their factor is 1 where the shape is right."""

_DERIVATIVE = 0.01
"""Step of a numerical derivative over a shape, as a share of its value (or of its range where linear)."""


_MODELS = 8
"""Drawn from what is known of the present model, to see what that makes of a finding."""

_SURE = 5.0
"""Standard deviations by which a parameter differs from zero to be simulated."""


@dataclass(frozen=True)
class Component:
    """One effect of a finding before its shape is fixed."""

    family: EffectFamily
    place: Place
    shape: tuple[float, ...]

    @classmethod
    def of(cls, trial: Trial) -> Component:
        return cls(trial.family, trial.place, trial.effect.shape)

    def shapes(self, examination: Examination) -> tuple[Shape, ...]:
        return self.family.shapes(examination.base.model.robot, self.place)

    def effect(self, examination: Examination, present: Present) -> PlacedEffect:
        return self.family.effect(examination.base.model.robot, self.place, self.shape, present)


@dataclass(frozen=True)
class Refined:
    """Effects at their best shapes.

    Attributes:
        effects: with their shapes.
        linear: per effect, its linear parameters (p,).
        linear_sigma, shape_sigma: per effect, standard deviations.
        gain: what they take off the residual sum of squares together.
        left: residual sum of squares over noise, per row, once they are added.
    """

    effects: tuple[PlacedEffect, ...]
    linear: tuple[FloatArray, ...]
    linear_sigma: tuple[FloatArray, ...]
    shape_sigma: tuple[FloatArray, ...]
    gain: float
    left: float
    seen: tuple[BoolArray, ...]
    """Per effect, which of its parameters the data show."""


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
    refined = _with_deviations(examination, best, present, exact)
    if exact and examination.loop is None:
        beside = _beside(examination, refined, present)
        best = _best_shapes(examination, best, beside, 0.1, _AGAIN, exact)
        refined = _with_deviations(examination, best, beside, exact)
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
    shapes = _shapes(examination, components)
    if all(shape.fixed for shape in shapes):
        return list(components)
    search = _ShapeSearch(examination, components, shapes, present)
    start = np.array([_inner(s, v) for s, v in zip(shapes, _values(components), strict=True)])
    in_loop = exact and examination.loop is not None
    point = search.best(start, width, evaluations, exact=exact and not in_loop)
    if in_loop:
        # What a loop answers about finds the region; of that the simulation takes the best point.
        starts = [*search.other_forms(point), *search.other_forms(start)]
        losses = [search.loss(one, True) for one in starts]
        nearest = starts[int(np.argmin(losses))]
        point = search.best(nearest, 0.25, _SIMULATED, exact=True)
    return _at(components, shapes, point)


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


@dataclass(frozen=True)
class _ShapeSearch:
    """Points are the shapes' inner values (s,); those of fixed shapes stay where a search starts."""

    examination: Examination
    components: Sequence[Component]
    shapes: Sequence[Shape]
    present: Present

    def loss(self, point: FloatArray, exact: bool) -> float:
        """Minus the gain; in closed loop, where exact, that of a simulation with all that was found."""
        placed = _at(self.components, self.shapes, point)
        if exact and self.examination.loop is not None:
            return -_simulated_gain(self.examination, placed, self.present)
        solved = _solve(self.examination, placed, self.present, exact=exact)
        return 0.0 if solved is None else -solved[1]

    def best(self, start: FloatArray, width: float, evaluations: int, exact: bool) -> FloatArray:
        """The point that a simplex of so many steps of the grid finds (Nelder and Mead 1965)."""
        free = np.array([not shape.fixed for shape in self.shapes], dtype=np.bool_)
        limits = np.array([(_inner(s, s.lower), _inner(s, s.upper)) for s in self.shapes])[free]
        steps = width * np.array([_grid_step(shape) for shape in self.shapes])[free]

        def whole(point: FloatArray) -> FloatArray:
            moved = start.copy()
            moved[free] = np.clip(point, *limits.T)
            return moved

        def loss(point: FloatArray) -> float:
            return self.loss(whole(point), exact)

        found = minimize(
            loss,
            start[free],
            method="Nelder-Mead",
            bounds=[(float(low), float(high)) for low, high in limits],
            options={
                "maxfev": evaluations * int(free.sum()),
                "initial_simplex": np.vstack([start[free], start[free] + np.diag(steps)]),
                "xatol": 1e-3,
            },
        )
        return whole(np.asarray(found.x)) if found.fun <= self.loss(start, exact) else start

    def other_forms(self, point: FloatArray) -> list[FloatArray]:
        """The point with every combination of the values that fixed shapes can take."""
        choices = [
            [_inner(shape, value) for value in shape.grid] if shape.fixed else [float(x)]
            for shape, x in zip(self.shapes, point, strict=True)
        ]
        return [np.array(one) for one in product(*choices)]


def _simulated_gain(examination: Examination, components: Sequence[Component], present: Present) -> float:
    """What effects take off the residual sum of squares when they are simulated at their size.

    Columns are answers to small effects; dry friction that builds up late is not so small.
    """
    solved, loop = _solve(examination, components, present), examination.loop
    if solved is None or loop is None:
        return 0.0
    residual = left = examination.residual
    for component, values in zip(components, np.split(solved[0], np.cumsum(solved[3])[:-1]), strict=True):
        twin = loop.twin(component.effect(examination, present))
        change = loop.change(bristled(twin.simulated(values), loop.lengths, loop.robot), FINE)
        if change is None:
            return 0.0
        white = examination.whiten([change[:, :, np.newaxis]])
        left = left - examination.partial_out(white)[:, 0]
    return float(residual @ residual - left @ left)


def _with_deviations(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    exact: bool,
) -> Refined:
    """Standard deviations from the columns and the derivatives over the shapes (Gauss–Newton)."""
    shapes = _shapes(examination, components)
    solved = _solve(examination, components, present, exact=exact)
    if solved is None:
        raise ArithmeticError("the effects have no columns beyond the present model")
    parameters, gain, columns, counts = solved
    own = _at_measured(examination, components, present)
    if own is not None:
        bounds = np.array([b for c in components for b in c.effect(examination, present).bounds])
        better = instrumented(columns, own, examination.residual, bounds)
        own, parameters = (None, parameters) if better is None else (own, better)
    slopes, own_slopes = _slopes(examination, components, shapes, present, parameters, columns, own, exact)
    matrix = np.concatenate([columns, slopes], axis=1)
    whole = matrix if own is None else np.concatenate([own, own_slopes], axis=1)
    change = (columns if own is None else examination.left_of(own)) @ parameters
    residual = examination.residual - change
    left = float(residual @ residual / max(1, residual.size - examination.base.independent.size))
    sigma = deviations(examination, matrix, whole, residual)
    if exact and examination.loop is None:
        sigma = np.hypot(sigma, _of_present(examination, components, present, parameters, columns, matrix))
    physical = [
        deviation * (value if shape.logarithmic else 1.0)
        for deviation, shape, value in zip(sigma[parameters.size :], shapes, _values(components), strict=True)
    ]
    cuts = np.cumsum(counts)[:-1]
    starts = np.cumsum([len(component.shape) for component in components])[:-1]
    noise = np.split(np.array(physical), starts)
    factors = np.split(parameters, cuts)
    per_shape = [
        beside_factor(component, of_noise, factor)
        for component, of_noise, factor in zip(components, noise, factors, strict=True)
    ]
    return Refined(
        tuple(component.effect(examination, present) for component in components),
        tuple(factors),
        tuple(np.split(sigma[: parameters.size], cuts)),
        tuple(per_shape),
        gain,
        left,
        tuple(np.split(np.linalg.norm(columns, axis=0) > 0.0, cuts)),
    )


def _of_present(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    parameters: FloatArray,
    columns: FloatArray,
    matrix: FloatArray,
) -> FloatArray:
    """Deviations (k,) that come of what is not known of the present model: the columns are made of it.

    Links that are known to a tenth make the error of a gear that moves them known to a tenth.

    Args:
        examination, components, present: as in :func:`refine`.
        parameters: of the columns (p,).
        columns: (N, p) at the present model.
        matrix: (N, k) columns and slopes, whose factors deviate.
    """
    base, beta = examination.base, examination.beta
    values, vectors = np.linalg.eigh(examination.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    known = base.standard_from(beta, base.model.prior())
    changes = np.zeros((_MODELS, columns.shape[0]))
    draws = np.random.default_rng(0).standard_normal((_MODELS, beta.size))
    for change, draw in zip(changes, draws, strict=True):
        moved = base.standard_from(beta + root @ draw, base.model.prior()) - known
        other = Present(present.model, present.standard + moved)
        solved = _solve(examination, components, other, parameters)
        if solved is not None and solved[2].shape == columns.shape:
            change[:] = (solved[2] - columns) @ parameters
        if not change.any():
            break  # a body that was added is the same on any arm
    size = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    shifts = np.linalg.lstsq(matrix / size, changes.T, rcond=np.sqrt(DEPENDENT))[0] / size[:, np.newaxis]
    return np.asarray(np.sqrt(np.mean(shifts**2, axis=1)))


def _at_measured(
    examination: Examination, components: Sequence[Component], present: Present
) -> FloatArray | None:
    """Whitened columns (N, p) at the measured motion; None where it is its own instrument, or simulated."""
    if examination.loop is not None or all(scene.period is None for scene in examination.scenes):
        return None
    effects = [component.effect(examination, present) for component in components]
    return np.concatenate(
        [
            examination.whiten([effect_rows(scene, effect, measured=True) for scene in examination.scenes])
            for effect in effects
        ],
        axis=1,
    )


def _slopes(
    examination: Examination,
    components: Sequence[Component],
    shapes: Sequence[Shape],
    present: Present,
    parameters: FloatArray,
    columns: FloatArray,
    own: FloatArray | None,
    exact: bool,
) -> tuple[FloatArray, FloatArray]:
    """(N, s) derivatives over the shapes of what the effects make, at the instruments and as measured."""
    point = np.array([_inner(s, v) for s, v in zip(shapes, _values(components), strict=True)])
    slopes = np.zeros((2, columns.shape[0], len(shapes)))
    for k, shape in enumerate(shapes):
        if shape.fixed:
            continue
        step = _DERIVATIVE * (1.0 if shape.logarithmic else shape.upper - shape.lower)
        if point[k] + step > _inner(shape, shape.upper):
            step = -step
        moved = point.copy()
        moved[k] += step
        there = _at(components, shapes, moved)
        other = _solve(examination, there, present, parameters, exact)
        if other is not None:
            slopes[0, :, k] = (other[2] - columns) @ parameters / step
        beside = None if own is None else _at_measured(examination, there, present)
        if own is not None and beside is not None:
            slopes[1, :, k] = (beside - own) @ parameters / step
    return slopes[0], slopes[1]


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


def beside_factor(component: Component, deviations: FloatArray, factor: FloatArray) -> FloatArray:
    """Deviations of an effect's shape (s,), with what its factor says of the form being not quite that.

    Noise is the least of it where the form is wrong: a stiffness that goes with a factor of 0.8 is known to a
    fifth, however clearly the data prefer it to any other.
    """
    if component.family.name not in _FACTOR_OF_ONE or not factor.size:
        return deviations
    sizes = np.abs(np.array(component.shape))
    wrong = np.hypot(deviations, sizes * (1.0 - float(factor[0])))
    return np.asarray(np.where(deviations > 0.0, wrong, deviations))


def _solve(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    fixed: FloatArray | None = None,
    exact: bool = True,
) -> tuple[FloatArray, float, FloatArray, list[int]] | None:
    """Linear parameters, gain, partialled columns and how many belong to each effect."""
    effects = [component.effect(examination, present) for component in components]
    blocks = [partialled(examination, effect, exact) for effect in effects]
    if any(block is None for block in blocks):
        return None
    columns = np.concatenate([block for block in blocks if block is not None], axis=1)
    counts = [block.shape[1] for block in blocks if block is not None]
    residual = examination.residual
    if fixed is None:
        bounds = np.array([limit for effect in effects for limit in effect.bounds])
        fixed = within_bounds(columns, residual, bounds)
    explained = columns @ fixed
    return np.asarray(fixed), float(2 * explained @ residual - explained @ explained), columns, counts


def _shapes(examination: Examination, components: Sequence[Component]) -> list[Shape]:
    return [shape for component in components for shape in component.shapes(examination)]


def _values(components: Sequence[Component]) -> list[float]:
    return [value for component in components for value in component.shape]


def _at(components: Sequence[Component], shapes: Sequence[Shape], point: FloatArray) -> list[Component]:
    """The components with shapes from a point of the search space."""
    values = [float(np.exp(x) if shape.logarithmic else x) for shape, x in zip(shapes, point, strict=True)]
    moved, start = [], 0
    for component in components:
        end = start + len(component.shape)
        moved.append(Component(component.family, component.place, tuple(values[start:end])))
        start = end
    return moved


def _inner(shape: Shape, value: float) -> float:
    return float(np.log(value)) if shape.logarithmic else float(value)


def _grid_step(shape: Shape) -> float:
    """Distance of neighbours on the grid, in the space that is searched."""
    if len(shape.grid) < 2:
        return 0.1 * (_inner(shape, shape.upper) - _inner(shape, shape.lower))
    points = np.array([_inner(shape, value) for value in shape.grid])
    return float(np.median(np.abs(np.diff(points))))
