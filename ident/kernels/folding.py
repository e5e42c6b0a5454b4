"""A column folded over many periods, and of each the part of a turn in which it explains most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ident.kernels.compilation import compiled, making_arrays
from robots.arrays import FloatArray, IntArray


@compiled
def folded(
    turn: tuple[FloatArray, float],
    rows: tuple[FloatArray, FloatArray, FloatArray],
    sums: FloatArray,
    cells: NDArray[np.int32],
) -> None:
    """Sums over the cells of a turn.

    Cells of all rows are found first, which processors do for several at once, and are unsigned where they
    are places in an array: one that may be negative is looked at before it is taken. In half the time so.

    Args:
        turn: (rows,) time in s, and the frequency in Hz.
        rows: as of :func:`best_parts`.
        sums: (3, cells + 1), is filled: of the first two what comes before each cell, of the third what a
            part loses that ends before it.
        cells: (rows,), is filled: the cell of each row, from 1.
    """
    time, frequency = turn
    agreed, within, crossing = rows
    agreements, products, lost = sums[0], sums[1], sums[2]
    last, one = np.uint64(sums.shape[1] - 1), np.uint64(1)
    sums[:] = 0.0
    for row in range(time.size):
        at = time[row] * frequency
        cells[row] = min(np.int32((at - np.floor(at)) * last), np.int32(last - one)) + 1
    before = np.uint64(cells[0])
    for row in range(time.size):
        cell = np.uint64(cells[row])
        agreements[cell] += agreed[row]
        products[cell] += within[row]
        while before != cell:
            before = before + one if before < last else one
            lost[before - one] += crossing[row]
    for k in range(1, sums.shape[1]):
        agreements[k] += agreements[k - 1]
        products[k] += products[k - 1]


@making_arrays
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
    of_turn, cell_of = np.empty((3, cells.max() + 1)), np.empty(time.size, np.int32)
    for f in range(frequencies.size):
        n = cells[f]
        sums = of_turn[:, : n + 1]
        folded((time, frequencies[f]), rows, sums, cell_of)
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
