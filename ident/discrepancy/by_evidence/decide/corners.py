"""What acts beyond a position of a joint, on one side of it: from which on, the residual shows.

A motion may cover a tenth of the travel, and what it presses against stand anywhere in it: of a few positions
all over the travel none is near. Beside a set a column from each position that was passed is a small solve.
As of waves and boxes, this only chooses what is tried.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.discrepancy.by_evidence.decide.boxes import PEAKS, highest
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.family import PresentModel, State
from ident.effects.placed import Placed
from robots.arrays import FloatArray


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
    found_there: list[tuple[float, float, float]] = []
    for side in sides.grid:
        gain = _gains(rows, found, candidate, present, [(one, side) for one in tried])
        found_there += [(float(gain[peak]), tried[peak], side) for peak in highest(gain)]
    found_there.sort(reverse=True)
    return [(position, side) for _, position, side in found_there[:PEAKS]]


def _gains(
    rows: Rows,
    found: Found,
    candidate: Candidate,
    present: PresentModel,
    shapes: list[tuple[float, float]],
) -> FloatArray:
    """(shapes,) nats that the effect has beside all else, of each by itself."""
    if not shapes:
        return np.zeros(0)
    placed = [candidate.at(rows.prepared.robot, shape, present) for shape in shapes]
    first = placed[0]
    assert isinstance(first, Placed)

    def law(state: State) -> FloatArray:
        return np.concatenate([one.columns(state) for one in placed], axis=2)

    kept = ("parameters", "bounds", "scale", "centre")
    all_of_them = replace(first, law=law, **{name: getattr(first, name) * len(placed) for name in kept})
    entry = Entry(candidate, all_of_them, rows.effect(all_of_them))
    own, score = information_beside(rows, found.level, found.members, (entry,))
    information = 1.0 + np.diag(own)
    return np.asarray(0.5 * np.maximum(score, 0.0) ** 2 / information - 0.5 * np.log(information))
