"""What effects at given shapes take off the residual by their columns."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.bounded import within_bounds
from ident.discrepancy.component import Component
from ident.discrepancy.examination import Examination
from ident.discrepancy.partialled import partialled
from ident.effects.family import PlacedEffect
from ident.parameters.present import Present
from robots.arrays import FloatArray

_KEPT = 12
"""Effects whose columns are kept."""

_NOTHING = 1e-9
"""Norm of a whitened column of a parameter of its usual size that no row shows."""


def solve(
    examination: Examination,
    components: Sequence[Component],
    present: Present,
    fixed: FloatArray | None = None,
) -> tuple[FloatArray, float, FloatArray, list[int]] | None:
    """Linear parameters, gain, partialled columns and how many belong to each effect."""
    placed = [_placed(examination, component, present) for component in components]
    effects, blocks = [effect for effect, _ in placed], [block for _, block in placed]
    if any(block is None for block in blocks):
        return None
    columns = np.concatenate([block for block in blocks if block is not None], axis=1)
    usual = np.array([size for effect in effects for size in effect.scale])
    # A level at standstill is e⁻²⁷⁰ of itself where a drive moves, and would be as large as that is small.
    columns = np.where(np.linalg.norm(columns, axis=0) * usual > _NOTHING, columns, 0.0)
    counts = [block.shape[1] for block in blocks if block is not None]
    residual = examination.residual
    if fixed is None:
        bounds = np.array([limit for effect in effects for limit in effect.bounds])
        fixed = within_bounds(columns, residual, bounds)
    explained = columns @ fixed
    return np.asarray(fixed), float(2 * explained @ residual - explained @ explained), columns, counts


def _placed(
    examination: Examination, component: Component, present: Present
) -> tuple[PlacedEffect, FloatArray | None]:
    """An effect with its partialled columns; a search over the shapes of one asks for the others often."""
    kept = examination.placed
    found = kept.pop(component, None)
    if found is None or found[0] is not present:
        effect = component.effect(examination, present)
        found = (present, effect, partialled(examination, effect))
    kept[component] = found  # the one that was asked for last stands last
    if len(kept) > _KEPT:
        del kept[next(iter(kept))]
    return found[1], found[2]
