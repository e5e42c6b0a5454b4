"""Triangle and products of tall matrices, block by block: what least squares needs without another copy."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray

_ROWS = 4000
"""Rows of one block: mostly of one joint, where half of the columns are zero."""


def triangle_of(x: FloatArray) -> FloatArray:
    """R of x = Q R (r, b), at most b × b, by blocks of rows (Golub and Van Loan, 5.2)."""
    parts = (x[start : start + _ROWS] for start in range(0, len(x), _ROWS))
    return np.asarray(np.linalg.qr(np.vstack([_of_block(part) for part in parts]), mode="r"))


def _of_block(block: FloatArray) -> FloatArray:
    """Few rows with the products of the block's columns; those that are zero are left out of the work."""
    alive = block.any(axis=0)
    r = np.asarray(np.linalg.qr(block[:, alive], mode="r"))
    found = np.zeros((len(r), block.shape[1]))
    found[:, alive] = r
    return found


def triangle_beside(
    x: FloatArray, y: FloatArray, weights: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """R of the weighted columns, and Qᵀy: all that is needed of them to solve for y.

    Args:
        x: (r, b), r > b.
        y: (r,), weighted already.
        weights: (r,) of the rows of x; 1 where None.
    """
    count = x.shape[1]
    found = np.empty((0, count + 1))
    for start in range(0, len(x), _ROWS):
        part = slice(start, start + _ROWS)
        block = x[part] if weights is None else x[part] * weights[part, np.newaxis]
        rows = np.vstack([found, _of_block(np.column_stack([block, y[part]]))])
        found = np.asarray(np.linalg.qr(rows, mode="r")) if len(rows) > count else rows
    if len(found) and np.tril(found, -1).any():
        found = np.asarray(np.linalg.qr(found, mode="r"))
    return np.asarray(found[:count, :count]), np.asarray(found[:count, count])


def weighted_product(z: FloatArray, x: FloatArray, weights: FloatArray) -> FloatArray:
    """Zᵀ W X (a, b).

    Args:
        z: (r, a).
        x: (r, b).
        weights: (r,) diagonal of W.
    """
    total = np.zeros((z.shape[1], x.shape[1]))
    for start in range(0, len(x), _ROWS):
        part = slice(start, start + _ROWS)
        total += z[part].T @ (x[part] * weights[part, np.newaxis])
    return total
