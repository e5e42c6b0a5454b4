"""What effects at given shapes take off the residual by their columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.bounded import within_bounds
from ident.discrepancy.component import Component
from ident.discrepancy.examination import Examination
from ident.discrepancy.library import partialled
from ident.parameters.present import Present
from robots.arrays import FloatArray


def solve(
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
