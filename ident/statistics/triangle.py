"""The triangle of a tall matrix, block by block: its singular values and directions without another copy."""

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
