"""Rows through a short filter, in machine code: every column of every effect of a vocabulary passes one."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from robots.arrays import FloatArray, IntArray


def filtered(
    values: FloatArray,
    joint: int,
    chosen: IntArray,
    taps: FloatArray,
    scale: FloatArray | None = None,
    single: bool = False,
    least: float = 0.0,
) -> FloatArray | NDArray[np.float32] | None:
    """Some filtered rows of a joint; None where none of them has anything.

    Args:
        values: rows × joints × p.
        joint: which.
        chosen: (N,) rows, each with at least as many before it as there are taps after the first.
        taps: of the filter, the present row's first.
        scale: (p,) that each column is multiplied by, 1 where None.
        single: whether the answer is of half the size; it is calculated as precisely.
        least: what is nothing.

    Returns:
        (N, p).
    """
    values = np.ascontiguousarray(values, dtype=np.float64)
    count = values.shape[2]
    scale = np.ones(count) if scale is None else np.ascontiguousarray(scale, dtype=np.float64)
    out = np.empty((chosen.size, count), dtype=np.float32 if single else np.float64)
    return out if _kernel()(values, joint, chosen, taps, scale, out) > least else None


@cache
def _kernel() -> Callable[..., float]:
    """Machine code, kept on disk."""
    # Imported here: the compiler takes a second to load, and most commands need no rows.
    from ident.kernels.compilation import compiled_with_stamp

    return compiled_with_stamp(_run, Path(__file__).read_bytes())


def _run(
    values: FloatArray,
    joint: int,
    chosen: IntArray,
    taps: FloatArray,
    scale: FloatArray,
    out: FloatArray | NDArray[np.float32],
) -> float:
    """Write the rows; the largest of them."""
    there = False
    for row in range(values.shape[0]):
        for column in range(values.shape[2]):
            if values[row, joint, column] != 0.0:
                there = True
                break
        if there:
            break
    largest = 0.0
    if not there:
        return largest
    for k in range(chosen.size):
        row = chosen[k]
        for column in range(values.shape[2]):
            total = taps[0] * values[row, joint, column]
            for lag in range(1, taps.size):
                total += taps[lag] * values[row - lag, joint, column]
            value = total * scale[column]
            out[k, column] = value
            if abs(value) > largest:
                largest = abs(value)
    return largest
