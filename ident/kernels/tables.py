"""Compiled look-up of tabulated functions."""

from __future__ import annotations

import math

from ident.kernels.compilation import compiled
from robots.arrays import FloatArray


@compiled
def look_up(values: FloatArray, tables: FloatArray, number: int, x: float) -> tuple[float, float, float]:
    """Value, slope and second derivative: the cubic through four neighbours, a straight line outside.

    Args:
        values, tables: as in ``values.Extras``.
        number: which table; it has at least four values.
        x: where.
    """
    first, count, per_unit = int(tables[number, 0]), int(tables[number, 1]), tables[number, 3]
    t = (x - tables[number, 2]) * per_unit
    inside = min(max(t, 0.0), count - 1.0)
    cell = min(max(math.floor(inside), 1), count - 3)
    s = inside - cell
    a, b, c, d = (
        values[first + cell - 1],
        values[first + cell],
        values[first + cell + 1],
        values[first + cell + 2],
    )
    c1, c2, c3 = -a / 3 - b / 2 + c - d / 6, (a + c) / 2 - b, (d - a) / 6 + (b - c) / 2
    value = b + s * (c1 + s * (c2 + s * c3))
    slope = c1 + s * (2 * c2 + 3 * s * c3)
    if inside != t:
        return value + slope * (t - inside), slope * per_unit, 0.0
    return value, slope * per_unit, (2 * c2 + 6 * s * c3) * per_unit * per_unit
