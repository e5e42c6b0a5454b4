"""The triangle of a tall matrix, block by block: what least squares needs of it without another copy."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray

_ROWS = 20_000
"""Rows of one block."""


def triangle_of(x: FloatArray) -> FloatArray:
    """R of x = Q R (r, b), at most b × b, by blocks of rows (Golub and Van Loan, 5.2)."""
    found = np.linalg.qr(x[:_ROWS], mode="r")
    for start in range(_ROWS, len(x), _ROWS):
        found = np.linalg.qr(np.vstack([found, x[start : start + _ROWS]]), mode="r")
    return np.asarray(found)


def triangle_beside(
    x: FloatArray, y: FloatArray, weights: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """R of the weighted columns, and Qᵀy: all that is needed of them to solve for y.

    Args:
        x: (r, b), r > b.
        y: (r,), weighted already.
        weights: (r,) of the rows of x; 1 where None.
    """
    found = np.empty((0, x.shape[1] + 1))
    for start in range(0, len(x), _ROWS):
        part = slice(start, start + _ROWS)
        block = x[part] if weights is None else x[part] * weights[part, np.newaxis]
        block = np.column_stack([block, y[part]])
        rows = np.vstack([found, block]) if len(found) else block
        found = np.asarray(np.linalg.qr(rows, mode="r"))
    count = x.shape[1]
    return np.asarray(found[:count, :count]), np.asarray(found[:count, count])
