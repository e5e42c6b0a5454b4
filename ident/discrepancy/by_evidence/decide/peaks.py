"""What is tried of a shape that can be anything: at the highest peaks of a gain over it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.family import PresentModel
from robots.arrays import FloatArray, IntArray

PEAKS = 2
"""Of one form, that are tried."""


def highest(gain: FloatArray) -> IntArray:
    """Peaks of a curve, the highest first."""
    inside = np.flatnonzero((gain[1:-1] >= gain[:-2]) & (gain[1:-1] >= gain[2:])) + 1
    return np.asarray(inside[np.argsort(-gain[inside], kind="stable")])


def tried_at(
    rows: Rows, candidate: Candidate, shapes: Iterable[tuple[float, ...]], present: PresentModel
) -> list[Entry]:
    """A candidate with each of some shapes, those that the data show anything of."""
    placed = [candidate.at(rows.prepared.robot, shape, present) for shape in shapes]
    entries = [Entry(candidate, one, rows.effect(one, single=True)) for one in placed]
    there = [one for one in entries if one.white.there]
    rows.keep_products_with([one.white for one in there])
    return there
