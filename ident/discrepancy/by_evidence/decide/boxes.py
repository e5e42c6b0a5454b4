"""What comes and goes again and again in time: which courses the residual shows, of more than can be tried.

Rows are folded over a period, and of all parts of it the one is looked for in which the effect's column
agrees most with the residual (box least squares; Kovács, Zucker and Mazeh 2002, of planets before their
stars): by its edges, to a row, and by cells. As of waves, this only chooses what is tried.
"""

from __future__ import annotations

import numpy as np

from ident.discrepancy.by_evidence.decide.cells import best_cells
from ident.discrepancy.by_evidence.decide.edges import Agreement, best_edges
from ident.discrepancy.by_evidence.decide.peaks import PEAKS, tried_at
from ident.discrepancy.by_evidence.decide.screening import gains_beside
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.rows import Rows, effect_rows
from ident.discrepancy.by_evidence.library.candidates import Candidate
from ident.effects.family import PresentModel
from ident.effects.placed import Placed
from robots.arrays import FloatArray

_PARTS = 8
"""That are asked for beside all else that the model has."""


def best_boxes(
    rows: Rows, found: Found, candidate: Candidate, present: PresentModel, said: FloatArray
) -> list[tuple[float, ...]]:
    """Period, share of it and beginning in it, at peaks of the gain over the period.

    Args:
        rows: the data.
        found: the set that the residual is of.
        candidate: with these three shapes, and one parameter that is not negative.
        present: the model that columns are made of.
        said: rows × joints, Wᵀu over s², u the white residual and W the whitening of a joint.
    """
    prepared, shortest = rows.prepared, candidate.shapes[0].grid[-1]
    always = candidate.at(prepared.robot, (shortest, 1.0, 0.0), present)
    assert isinstance(always, Placed)
    height = effect_rows(prepared, always)[:, :, 0]
    agreed, products = np.sum(said * height, axis=1), _products(rows, height, found.level.excess**2)
    time = np.concatenate([np.asarray(part.at_rows.time) for part in prepared.parts])
    seen = Agreement(time, agreed, products, always.scale[0])
    by_cells = best_cells(rows, found, candidate, always, seen)
    return [*_to_a_row(rows, found, candidate, present, seen), *by_cells]


def _to_a_row(
    rows: Rows, found: Found, candidate: Candidate, present: PresentModel, seen: Agreement
) -> list[tuple[float, ...]]:
    """The same of any period, by edges: first by themselves and then beside all else."""
    (period, share, _), luck = candidate.shapes, np.log(candidate.combinations)
    parts = [
        part
        for gain, part in best_edges(seen, (min(period.grid), max(period.grid)), _PARTS)
        if gain > luck and share.lower <= part[1] <= share.upper
    ]
    tried = tried_at(rows, candidate, parts, present)
    order = np.argsort(-gains_beside(rows, found, tried), kind="stable")
    return [tried[k].placed.shape for k in order[:PEAKS]]


def _products(rows: Rows, height: FloatArray, squares: FloatArray) -> FloatArray:
    """(lags, rows) products of the white column with itself, as pairs of a row and the one so many behind it.

    Noise that remembers hides what is constant and shows an edge: a part of a column has the pairs within it.
    """
    order = max(noise.coefficients.size for noise in rows.noise)
    products = np.zeros((order + 1, height.shape[0]))
    for j in np.flatnonzero(height.any(axis=0)):
        h, taps, chosen = height[:, j], rows.noise[j].taps, rows.whiteners[j].chosen
        for k in range(taps.size):
            for i in range(taps.size - k):
                later, earlier = chosen - i, chosen - i - k
                weight = (2.0 if k else 1.0) * taps[i] * taps[i + k] / squares[j]
                products[k, earlier] += weight * h[later] * h[earlier]
    return products
