"""What comes and goes in time beside noise that forgets: which courses the residual shows, of a grid.

Rows are folded over a period, and of all parts of it the one is looked for in which the effect's column
agrees most with the residual (box least squares; Kovács, Zucker and Mazeh 2002, of planets before their
stars). As of waves, this only chooses what is tried.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.discrepancy.by_evidence.decide.peaks import PEAKS, highest
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.rows import Rows, effect_rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.family import PresentModel, State
from ident.effects.placed import Placed
from robots.arrays import FloatArray, IntArray

_CELLS = 40
"""Of a period; of 1 s the cell is a little more than the filter's reach."""

_FOLDED = 4
"""Periods of which parts are asked for with all else that the model has: time alone, as what is tried."""

_LENGTHS, _STARTS = np.arange(2, _CELLS - 1)[:, np.newaxis], np.arange(_CELLS)
"""Of parts of a period, in cells."""


def best_cells(
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
    prepared, periods = rows.prepared, candidate.shapes[0].grid
    always = candidate.at(prepared.robot, (periods[-1], 1.0, 0.0), present)
    assert isinstance(always, Placed)
    height = effect_rows(prepared, always)[:, :, 0]
    agreed, products = np.sum(said * height, axis=1), _products(rows, height, found.level.excess**2)
    time = np.concatenate([np.asarray(part.at_rows.time) for part in prepared.parts])
    alone = np.array([_alone(time / period, agreed, products, always.scale[0]) for period in periods])
    # What the best of so many tries has by luck is not asked for.
    some = [k for k in highest(alone)[:_FOLDED] if alone[k] > np.log(candidate.combinations)]
    folded = [(*_beside_all(rows, found, candidate, always, periods[k]), k) for k in some]
    folded.sort(key=lambda one: -one[0])
    return [(periods[k], share, beginning) for _, share, beginning, k in folded[:PEAKS]]


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


def _alone(turns: FloatArray, agreed: FloatArray, products: FloatArray, scale: float) -> float:
    """About how many nats the best part of a period has, as if nothing else could take up what it explains.

    Args:
        turns: (rows,) of the period.
        agreed: (rows,) of the column with the residual.
        products: (lags, rows) of :func:`_products`.
        scale: deviation of its parameter.
    """
    cell = _cell(turns)
    score = _within(np.bincount(cell, agreed, _CELLS), _LENGTHS)
    information = np.full(score.shape, 1.0 / scale**2)
    for k, weights in enumerate(products):
        apart = np.mod(np.roll(cell, -k) - cell, _CELLS)
        sums = np.bincount(_CELLS * apart + cell, weights, _CELLS**2).reshape(_CELLS, _CELLS)
        for cells in np.flatnonzero(sums.any(axis=1)):
            information += _within(sums[cells], np.maximum(_LENGTHS - cells, 0))
    return float(np.max(0.5 * np.maximum(score, 0.0) ** 2 / information))


def _beside_all(
    rows: Rows, found: Found, candidate: Candidate, always: Placed, period: float
) -> tuple[float, float, float]:
    """Nats of the best part of a period beside all else, and its length and beginning, in periods."""

    def law(state: State) -> FloatArray:
        inside = _cell(np.asarray(state.time) / period)[:, np.newaxis] == _STARTS
        return np.asarray(always.law(state) * inside[:, np.newaxis, :])

    many = {name: getattr(always, name) * _CELLS for name in ("parameters", "bounds", "scale", "centre")}
    cells = replace(always, law=law, **many)
    entry = Entry(candidate, cells, rows.effect(cells))
    own, score = information_beside(rows, found.level, found.members, (entry,))
    twice = np.zeros((2 * _CELLS + 1, 2 * _CELLS + 1))
    twice[1:, 1:] = np.tile(own, (2, 2)).cumsum(axis=0).cumsum(axis=1)
    ends = _STARTS + _LENGTHS
    information = (
        1.0 + twice[ends, ends] - twice[_STARTS, ends] - twice[ends, _STARTS] + twice[_STARTS, _STARTS]
    )
    gain = 0.5 * np.maximum(_within(score, _LENGTHS), 0.0) ** 2 / information
    best = np.unravel_index(int(np.argmax(gain)), gain.shape)
    return float(gain[best]), float(_LENGTHS[best[0], 0]) / _CELLS, float(_STARTS[best[1]]) / _CELLS


def _cell(turns: FloatArray) -> IntArray:
    """(rows,) which cell of its period each is in."""
    return np.asarray(np.floor(np.mod(turns, 1.0) * _CELLS).astype(np.int64) % _CELLS)


def _within(sums: NDArray[Any], lengths: IntArray) -> FloatArray:
    """Of cells of a period, the sums over parts of it, which may go on from its end to its beginning."""
    along = np.concatenate([[0.0], np.cumsum(np.concatenate([sums, sums]))])
    return np.asarray(along[_STARTS + lengths] - along[_STARTS])
