"""Linear parameters of effects at given shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.component import Component
from ident.discrepancy.deviations import instrumented
from ident.discrepancy.examination import Examination
from ident.discrepancy.solved import solve
from ident.parameters.present import Present
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Fit:
    """Effects beside the present model.

    Attributes:
        parameters: (p,) linear ones of all effects.
        columns: (N, p) at the instruments' motion, partialled out of the present model.
        own: (N, p) whitened, at the measured motion, whose parameters these are; None where they are those
            of the columns themselves.
        counts: parameters per effect.
    """

    parameters: FloatArray
    columns: FloatArray
    own: FloatArray | None
    counts: tuple[int, ...]

    def of_effects(self, values: FloatArray) -> tuple[FloatArray, ...]:
        """Values (p,), or any that begin like the parameters, per effect."""
        return tuple(np.split(values[: self.parameters.size], np.cumsum(self.counts)[:-1]))


def fitted(examination: Examination, components: Sequence[Component], present: Present) -> Fit:
    """Fit the linear parameters of effects together.

    Raises:
        ArithmeticError: the present model explains all that the effects do.
    """
    solved = solve(examination, components, present)
    if solved is None:
        raise ArithmeticError("the effects have no columns beyond the present model")
    parameters, _, columns, counts = solved
    own = at_measured(examination, components, present)
    if own is not None:
        bounds = np.array([b for c in components for b in c.effect(examination, present).bounds])
        better = instrumented(columns, own, examination.residual, bounds)
        own, parameters = (None, parameters) if better is None else (own, better)
    return Fit(parameters, columns, own, tuple(counts))


def at_measured(
    examination: Examination, components: Sequence[Component], present: Present
) -> FloatArray | None:
    """Whitened columns (N, p) at the measured motion; None where it is its own instrument, or simulated."""
    return examination.measured_columns_of([one.effect(examination, present) for one in components])
