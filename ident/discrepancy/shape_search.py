"""The search for the shapes of effects that take most off the residual."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.optimize import minimize

from ident.discrepancy.component import Component, at_point, grid_step, inner
from ident.discrepancy.examination import Examination
from ident.discrepancy.solved import solve
from ident.parameters.present import Present
from robots.arrays import FloatArray


def best_shapes(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    width: float,
    evaluations: int,
    of: Iterable[int] | None = None,
) -> list[Component]:
    """The components at shapes that take most off the residual, one component after the other.

    Only the columns of that one are made anew: a delay beside a play had its columns made with every gap of
    the play that was tried.

    Args:
        examination: the present model on the recordings.
        components: effects with the shapes that the search begins with.
        present: the present model, for effects that ask it for torques.
        width: of its first steps, in steps of the grid.
        evaluations: of the search, per shape.
        of: numbers of the components whose shapes are looked for; all by default.
    """
    best = list(components)
    for number in range(len(best)) if of is None else of:
        best[number] = _best_of(examination, best, number, present, width, evaluations)
    return best


def _best_of(
    examination: Examination,
    components: Sequence[Component],
    number: int,
    present: Present,
    width: float,
    evaluations: int,
) -> Component:
    """One of some components at the shapes that a simplex finds (Nelder and Mead 1965), beside the others."""
    one = components[number]
    shapes = one.shapes(examination)
    free = np.array([not shape.fixed for shape in shapes], dtype=np.bool_)
    if not free.any():
        return one
    start = np.array([inner(shape, value) for shape, value in zip(shapes, one.shape, strict=True)])
    limits = np.array([(inner(s, s.lower), inner(s, s.upper)) for s in shapes])[free]
    steps = width * np.array([grid_step(shape) for shape in shapes])[free]

    def moved(point: FloatArray) -> Component:
        whole = start.copy()
        whole[free] = np.clip(point, *limits.T)
        return at_point([one], shapes, whole)[0]

    def loss(component: Component) -> float:
        """Minus the gain; without columns there is none."""
        others = [component if k == number else other for k, other in enumerate(components)]
        solved = solve(examination, others, present)
        return np.inf if solved is None else -solved[1]

    before = loss(one)
    if before == np.inf:
        return one
    found = minimize(
        lambda point: loss(moved(point)),
        start[free],
        method="Nelder-Mead",
        bounds=[(float(low), float(high)) for low, high in limits],
        options={
            "maxfev": evaluations * int(free.sum()),
            "initial_simplex": np.vstack([start[free], start[free] + np.diag(steps)]),
            "xatol": 1e-3,
        },
    )
    return moved(np.asarray(found.x)) if found.fun <= before else one
