"""The search for the shapes of effects that take most off the residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ident.discrepancy.component import Component, at_point, grid_step, inner, shapes_of, values_of
from ident.discrepancy.examination import Examination
from ident.discrepancy.solved import solve
from ident.effects.family import Shape
from ident.parameters.present import Present
from robots.arrays import FloatArray


def best_shapes(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    width: float,
    evaluations: int,
) -> list[Component]:
    """The components at the shapes that take most off the residual.

    Args:
        examination: the present model on the recordings.
        components: effects with the shapes that the search begins with.
        present: the present model, for effects that ask it for torques.
        width: of its first steps, in steps of the grid.
        evaluations: of the search, per shape.
    """
    shapes = shapes_of(examination, components)
    if all(shape.fixed for shape in shapes):
        return list(components)
    search = ShapeSearch(examination, components, shapes, present)
    start = np.array([inner(s, v) for s, v in zip(shapes, values_of(components), strict=True)])
    return at_point(components, shapes, search.best(start, width, evaluations))


@dataclass(frozen=True)
class ShapeSearch:
    """Points are the shapes' inner values (s,); those of fixed shapes stay where a search starts."""

    examination: Examination
    components: Sequence[Component]
    shapes: Sequence[Shape]
    present: Present

    def loss(self, point: FloatArray) -> float:
        """Minus the gain."""
        solved = solve(self.examination, at_point(self.components, self.shapes, point), self.present)
        return 0.0 if solved is None else -solved[1]

    def best(self, start: FloatArray, width: float, evaluations: int) -> FloatArray:
        """The point that a simplex of so many steps of the grid finds (Nelder and Mead 1965)."""
        free = np.array([not shape.fixed for shape in self.shapes], dtype=np.bool_)
        limits = np.array([(inner(s, s.lower), inner(s, s.upper)) for s in self.shapes])[free]
        steps = width * np.array([grid_step(shape) for shape in self.shapes])[free]

        def whole(point: FloatArray) -> FloatArray:
            moved = start.copy()
            moved[free] = np.clip(point, *limits.T)
            return moved

        def loss(point: FloatArray) -> float:
            return self.loss(whole(point))

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
        return whole(np.asarray(found.x)) if found.fun <= self.loss(start) else start
