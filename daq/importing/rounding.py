"""Positions that were written with too few digits: rounding is then most of their noise."""

from __future__ import annotations

import numpy as np

from ident.listing import short
from robots.arrays import FloatArray

_MOST_DIGITS = 6
"""Behind the point; more are no loss for any arm."""
_WHOLE = 1e-4
"""Of a last digit: the rounding of a binary number."""
_LARGEST = 1e9
"""Of larger numbers a double does not hold six digits behind the point."""
_LOOKED_AT = 100_000
"""Samples; more say nothing else of a file's digits."""
_FOURTH = 70.0
"""Variance of the fourth differences of white noise of variance 1: 1 + 16 + 36 + 16 + 1."""


def digits_of(column: FloatArray) -> int | None:
    """How many digits behind the point all values of a column need; None where more than six, or none at all.

    Whole numbers are counts of an encoder.
    """
    if np.abs(column).max() > _LARGEST:
        return None
    for digits in range(_MOST_DIGITS + 1):
        scaled = column * 10.0**digits
        if np.abs(scaled - np.rint(scaled)).max() < _WHOLE:
            return digits or None
    return None


def rounded(name: str, labels: tuple[str, ...], values: FloatArray) -> tuple[str, ...]:
    """A sentence on the columns whose rounding is more than half of their noise, by variance.

    The fourth differences of a sampled motion are those of its noise and what the motion adds, so they
    bound the noise from above: a sentence is never due to too little motion.

    Args:
        name: of the log, for messages.
        labels: of the columns.
        values: samples × columns, as they stand in the file.
    """
    found = []
    for label, column in zip(labels, values[:_LOOKED_AT].T, strict=True):
        digits = digits_of(column)
        if digits is None or len(column) < 5 or np.ptp(column) == 0.0:
            continue
        noise = float(np.mean(np.diff(column, 4) ** 2)) / _FOURTH
        if 10.0 ** (-2 * digits) / 12 > noise / 2:
            found.append((label, digits))
    if not found:
        return ()
    digits = min(digits for _, digits in found)
    named = short(found[0][0]) if len(found) == 1 else f"{short(found[0][0])} and {len(found) - 1} more"
    return (
        f"{name}: {named} written with {digits} digits behind the point: rounding is most of the positions'"
        " noise and blurs friction; write more",
    )
