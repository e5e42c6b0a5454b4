"""A column folded over many periods, and of each the part of a turn in which it explains most."""

from __future__ import annotations

import numpy as np

from ident.kernels.compilation import compiled
from robots.arrays import FloatArray, IntArray


@compiled
def folded(
    time: FloatArray, rows: tuple[FloatArray, FloatArray, FloatArray], frequency: float, sums: FloatArray
) -> None:
    """Sums over the cells of a turn.

    Args:
        time: (rows,) s.
        rows: as of :func:`best_parts`.
        frequency: Hz.
        sums: (3, cells + 1), is filled: of the first two what comes before each cell, of the third what a
            part loses that ends before it.
    """
    agreed, within, crossing = rows
    n, before = sums.shape[1] - 1, -1
    sums[:] = 0.0
    for row in range(time.size):
        at = time[row] * frequency
        cell = min(int((at - np.floor(at)) * n), n - 1)
        sums[0, cell + 1] += agreed[row]
        sums[1, cell + 1] += within[row]
        while before >= 0 and before != cell:
            before = (before + 1) % n
            sums[2, before] += crossing[row]
        before = cell
    for cell in range(n):
        sums[0, cell + 1] += sums[0, cell]
        sums[1, cell + 1] += sums[1, cell]


@compiled
def best_parts(
    turns: tuple[FloatArray, FloatArray, IntArray],
    rows: tuple[FloatArray, FloatArray, FloatArray],
    sizes: FloatArray,
    prior: float,
) -> tuple[FloatArray, IntArray, IntArray]:
    """Gain of the best part of each turn, the cell it begins in and how many it has; it may go round.

    Of size θ a part that agrees with the residual by s and has information i gains θs − ½θ²i. Both are made
    of sums over all rows before its end less those over all before its beginning, so for one size the best
    beginning of each end is the best one before it.

    Args:
        turns: (rows,) time in s, (F,) Hz of turns that begin at time 0, and (F,) cells of a turn.
        rows: (rows,) of the column with the residual; information of a row and of its pairs with those behind
            it; and of the pairs that a part loses which ends before a row.
        sizes: (K,) θ that are tried.
        prior: information that is there before any row.
    """
    time, frequencies, cells = turns
    gain, first = np.zeros(frequencies.size), np.zeros(frequencies.size, np.int64)
    count = np.zeros(frequencies.size, np.int64)
    of_turn = np.empty((3, cells.max() + 1))
    for f in range(frequencies.size):
        n = cells[f]
        sums = of_turn[:, : n + 1]
        folded(time, rows, frequencies[f], sums)
        for size in sizes:
            square = 0.5 * size * size
            whole = size * sums[0, n] - square * sums[1, n]
            begin = end = 0  # the best beginning and the best end so far
            least, largest = 0.0, square * sums[2, 0]
            for cell in range(1, n):
                begins = size * sums[0, cell] - square * sums[1, cell]
                ends = begins + square * sums[2, cell]
                if ends - least - square * prior > gain[f]:
                    gain[f], first[f], count[f] = ends - least - square * prior, begin, cell - begin
                if whole + largest - begins - square * prior > gain[f]:  # round the turn's end
                    gain[f], first[f] = whole + largest - begins - square * prior, cell
                    count[f] = n + end - cell
                if begins < least:
                    least, begin = begins, cell
                if ends > largest:
                    largest, end = ends, cell
    return gain, first, count
