"""How the columns of rows stand in memory: time last, so that a column of a joint is one run.

Columns that are zero by structure, half of them all, are then whole runs that nobody writes to, which cost
none; the rows stacked joint by joint are the same memory; and transforms along time read it as it stands.
"""

from __future__ import annotations

import math
import mmap

import numpy as np

from robots.arrays import FloatArray


def torques_of(regressor: FloatArray, beta: FloatArray) -> FloatArray:
    """X β, samples × joints, of X, samples × joints × b, whose time is last in memory, and β (b,)."""
    joints, columns = regressor.shape[1:]
    return np.asarray((beta @ regressor.transpose(2, 1, 0).reshape(columns, -1)).reshape(joints, -1).T)


def one_after_the_other(parts: list[FloatArray]) -> FloatArray:
    """Pieces of samples × joints × b as one; each is given up once it is copied, so that none is twice."""
    (_, joints, columns), samples = parts[0].shape, sum(len(part) for part in parts)
    whole, end = untouched((columns, joints, samples)), samples
    while parts:
        part = parts.pop()
        start = end - len(part)
        for joint, column in np.argwhere(part.any(axis=0)):
            whole[column, joint, start:end] = part[:, joint, column]
        end = start
    return whole.transpose(2, 1, 0)


def untouched(shape: tuple[int, ...]) -> FloatArray:
    """Zeros of which only those pages take memory that are written to; NumPy's own large ones come in pages
    of two megabytes, which zeros share with their neighbours.
    """
    memory = mmap.mmap(-1, 8 * math.prod(shape), flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    return np.frombuffer(memory, dtype=np.float64).reshape(shape)
