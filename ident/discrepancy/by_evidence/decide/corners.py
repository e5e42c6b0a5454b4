"""What acts beyond a position of a joint, on one side of it: from which on, the residual shows.

A motion may cover a tenth of the travel, and what it presses against stand anywhere in it: of a few positions
all over the travel none is near. Beside a set a column from each position that was passed is a small solve.
As of waves and boxes, this only chooses what is tried.
"""

from __future__ import annotations

import numpy as np

from ident.discrepancy.by_evidence.decide.peaks import PEAKS, highest, tried_at
from ident.discrepancy.by_evidence.decide.screening import gains_beside
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Candidate
from ident.effects.family import PresentModel


def best_corners(
    rows: Rows, found: Found, candidate: Candidate, present: PresentModel
) -> list[tuple[float, ...]]:
    """Position and side, at the highest peaks of the gain over the position.

    Args:
        rows: the data.
        found: the set that the residual is of.
        candidate: with these two shapes, and one parameter that is not negative.
        present: the model that columns are made of.
    """
    (joint,), (corner, sides) = candidate.place.joints, candidate.shapes
    passed = np.concatenate([part.at_rows.position[:, joint] for part in rows.prepared.parts])
    low, high = float(passed.min()), float(passed.max())
    tried = [one for one in corner.grid if low < one < high]
    there: list[tuple[float, float, float]] = []
    for side in sides.grid:
        entries = tried_at(rows, candidate, [(one, side) for one in tried], present)
        gain = gains_beside(rows, found, entries)
        there += [(float(gain[peak]), *entries[peak].placed.shape) for peak in highest(gain)]
    there.sort(reverse=True)
    return [(position, side) for _, position, side in there[:PEAKS]]
