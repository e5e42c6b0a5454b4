"""What comes and goes in time, by cells of the periods of a grid, and beside all else that the model has.

Where the noise forgets, all of a part shows and not its edges alone: much of it may be taken up by what the
model has, and a period need not be right to a row for the rest to be seen.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.discrepancy.by_evidence.decide.edges import Agreement
from ident.discrepancy.by_evidence.decide.peaks import PEAKS, highest
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.placed import Placed
from ident.effects.state import State
from robots.arrays import FloatArray, IntArray

_CELLS = 40
"""Of a period; of 1 s the cell is a little more than the filter's reach."""

_FOLDED = 4
"""Periods of which parts are asked for with all else that the model has: time alone, as what is tried."""

_LENGTHS, _STARTS = np.arange(2, _CELLS - 1)[:, np.newaxis], np.arange(_CELLS)
"""Of parts of a period, in cells."""


def best_cells(
    rows: Rows, found: Found, candidate: Candidate, always: Placed, seen: Agreement
) -> list[tuple[float, ...]]:
    """Period, share of it and beginning in it, at peaks of the gain over the period.

    Args:
        rows: the data.
        found: the set that the residual is of.
        candidate: with these three shapes, and one parameter that is not negative.
        always: the candidate that is there all the time.
        seen: of its column with the residual.
    """
    periods = candidate.shapes[0].grid
    alone = np.array([_alone(period, seen) for period in periods])
    # What the best of so many tries has by luck is not asked for.
    some = [k for k in highest(alone)[:_FOLDED] if alone[k] > np.log(candidate.combinations)]
    folded = [(*_beside_all(rows, found, candidate, always, periods[k]), k) for k in some]
    folded.sort(key=lambda one: -one[0])
    return [(periods[k], share, beginning) for _, share, beginning, k in folded[:PEAKS]]


def _alone(period: float, seen: Agreement) -> float:
    """Nats of the best part of a period, about, as if nothing else could take up what it explains."""
    cell = _cell(seen.time / period)
    score = _within(np.bincount(cell, seen.agreed, _CELLS), _LENGTHS)
    information = np.full(score.shape, 1.0 / seen.scale**2)
    for k, weights in enumerate(seen.products):
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
