"""What of an effect the present model cannot explain."""

from __future__ import annotations

import numpy as np

from ident.discrepancy.examination import Examination
from ident.effects.family import PlacedEffect
from robots.arrays import FloatArray

_IN_SPAN = 1e-3
"""A column of which less than this share (of its norm) is outside the present model's span says nothing."""

_NOTHING = 1e-30
"""A column this small is what an exponential leaves far from where it acts."""


def partialled(examination: Examination, effect: PlacedEffect) -> FloatArray | None:
    """An effect's whitened columns (N, p) beyond the present model; None where nothing is beyond it.

    Args:
        examination: of the present model.
        effect: of the vocabulary.
    """
    white = examination.columns_of(effect)
    return None if white is None else _seen(white, examination.partial_out(white))


def _seen(white: FloatArray, beyond: FloatArray) -> FloatArray | None:
    """Columns beyond the present model, zero where they are hardly there; None where all are."""
    before = np.sqrt(np.einsum("rp,rp->p", white, white))
    if not np.isfinite(before).all() or not (before > _NOTHING).any():
        return None
    beyond[:, np.linalg.norm(beyond, axis=0) <= np.maximum(_IN_SPAN * before, _NOTHING)] = 0.0
    return beyond if beyond.any() else None
