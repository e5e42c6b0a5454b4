"""From the grid to the best shape, and from there to parameters with their standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ident.discrepancy.examination import Examination
from ident.discrepancy.library import Trial, partialled
from ident.discrepancy.present import Present
from ident.effects.family import EffectFamily, Place, PlacedEffect, Shape
from robots.arrays import BoolArray, FloatArray

_EVALUATIONS = 40

_DEPENDENT = 1e-6
"""Of the products of unit columns: below it a direction of the parameters is not seen."""

_FACTOR_OF_ONE = ("joint_elasticity", "backlash")
"""Effects whose size is in their shape, so that their factor is 1 where the shape is right."""

_DERIVATIVE = 0.01
"""Step of a numerical derivative over a shape, as a share of its value (or of its range where linear)."""


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
    shapes = [shape for component in components for shape in component.shapes(examination)]
    free = np.array([not shape.fixed for shape in shapes], dtype=np.bool_)
    start = np.array([_inner(s, v) for s, v in zip(shapes, _values(components), strict=True)])
    limits = [(_inner(s, s.lower), _inner(s, s.upper)) for s in shapes]
    best = list(components)
    if free.any():
        low, high = np.array(limits).T

        def at(point: FloatArray) -> list[Component]:
            whole = start.copy()
            whole[free] = np.clip(point, low[free], high[free])
            return _at(components, shapes, whole)

        def loss(point: FloatArray) -> float:
            placed = at(point)
            # Many evaluations: what a loop answers about is enough to find the shape.
            about = exact and examination.loop is None
            solved = _solve(examination, placed, present, exact=about)
            return 0.0 if solved is None else -solved[1]

        widths = np.array([_grid_step(shape) for shape in shapes])[free]
        simplex = np.vstack([start[free], start[free] + np.diag(0.5 * widths)])
        found = minimize(
            loss,
            start[free],
            method="Nelder-Mead",
            bounds=[limit for limit, loose in zip(limits, free, strict=True) if loose],
            options={"maxfev": evaluations * int(free.sum()), "initial_simplex": simplex, "xatol": 1e-3},
        )
        if found.fun <= loss(start[free]):
            best = at(np.asarray(found.x))
    return _with_deviations(examination, best, shapes, present, exact)


def _with_deviations(
    examination: Examination,
    components: Sequence[Component],
    shapes: Sequence[Shape],
    present: Present,
    exact: bool,
) -> Refined:
    """Standard deviations from the columns and the derivatives over the shapes (Gauss–Newton)."""
    solved = _solve(examination, components, present, exact=exact)
    if solved is None:
        raise ArithmeticError("the effects have no columns beyond the present model")
    parameters, gain, columns, counts = solved
    fitted = columns @ parameters
    jacobian = [columns]
    point = np.array([_inner(s, v) for s, v in zip(shapes, _values(components), strict=True)])
    slopes = []
    for k, shape in enumerate(shapes):
        if shape.fixed:
            slopes.append(np.zeros((fitted.size, 1)))
            continue
        step = _DERIVATIVE * (1.0 if shape.logarithmic else shape.upper - shape.lower)
        if point[k] + step > _inner(shape, shape.upper):
            step = -step
        moved = point.copy()
        moved[k] += step
        other = _solve(examination, _at(components, shapes, moved), present, parameters, exact)
        slope = step if other is None else (other[2] @ parameters - fitted) / step
        slopes.append(np.broadcast_to(slope, fitted.shape)[:, np.newaxis])
    matrix = np.concatenate(jacobian + slopes, axis=1)
    residual = examination.residual - fitted
    left = float(residual @ residual / max(1, residual.size - examination.base.independent.size))
    norms = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    unit = matrix / norms
    seen = norms > 1e-290
    variance = np.zeros(norms.size)
    inverse = np.linalg.pinv(unit[:, seen].T @ unit[:, seen], rcond=_DEPENDENT, hermitian=True)
    variance[seen] = np.diag(inverse) / norms[seen] ** 2
    sigma = np.sqrt(max(1.0, left) * variance)
    physical = [
        deviation * (value if shape.logarithmic else 1.0)
        for deviation, shape, value in zip(sigma[parameters.size :], shapes, _values(components), strict=True)
    ]
    cuts = np.cumsum(counts)[:-1]
    starts = np.cumsum([len(component.shape) for component in components])[:-1]
    noise = np.split(np.array(physical), starts)
    factors = np.split(parameters, cuts)
    per_shape = [
        beside_factor(component, deviations, factor)
        for component, deviations, factor in zip(components, noise, factors, strict=True)
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


def within_bounds(columns: FloatArray, residual: FloatArray, bounds: FloatArray) -> FloatArray:
    """Least squares (p,) with each parameter within what nature allows.

    One that would leave its bounds is held at the one it would leave by, and the others are fitted beside it:
    to cut it off afterwards would leave them where they made up for what it must not be.

    Args:
        columns: (N, p).
        residual: (N,).
        bounds: (p, 2), lowest and highest.
    """
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    unit, held = columns / scale, np.zeros(scale.size, dtype=np.bool_)
    values = np.zeros(scale.size)
    while not held.all():
        rest = residual - columns[:, held] @ values[held]
        free = ~held
        values[free] = np.linalg.lstsq(unit[:, free], rest, rcond=np.sqrt(_DEPENDENT))[0] / scale[free]
        beyond = np.maximum(bounds[:, 0] - values, values - bounds[:, 1]) * scale
        beyond[held] = 0.0
        worst = int(np.argmax(beyond))
        if beyond[worst] <= 0.0:
            break
        values[worst] = np.clip(values[worst], *bounds[worst])
        held[worst] = True
    return values


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
