"""An arm as its own thermometer: what all gears but one say of the hall that nobody measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.drift.patterns import WARMTH, Pattern
from ident.drift.wald import solve_covariance
from robots.arrays import FloatArray

_ANYTHING = 10.0
"""Deviation of friction that may be anything, in sizes of itself."""


def warmth_of_gears(
    values: FloatArray, spread: FloatArray, patterns: Sequence[Pattern], sigma: float
) -> FloatArray:
    """(N, c) warmth of the hall beside each chart, K: from the friction of all gears but that of its joint.

    Friction of every gear falls as the hall warms up, so what all of them share is the hall. A fault in one
    gear must not look like weather there: its own friction is left out, as if it might be anything. The
    estimate is the mean of the posterior, with the hall's warmth and the coefficients of the gears as the
    prior has them: where no other gear tells anything, as on a single axis, it is zero. By how much a chart
    follows it is learned as with a thermometer.

    Args:
        values: (N, b) base parameters.
        spread: (b, b) of a night: within a run, and what hall, coefficients and gears differ by.
        patterns: of the charts, c of them; the warmth of all gears among them, else nothing is known.
        sigma: deviation of the hall's warmth, K, as it is in the spread.
    """
    warmth = next((pattern.directions[:, 0] for pattern in patterns if pattern.effect == WARMTH), None)
    found = np.zeros((len(values), len(patterns)))
    if warmth is None:
        return found
    of_joint: dict[int | None, FloatArray] = {}
    for k, pattern in enumerate(patterns):
        if pattern.effect == WARMTH:
            continue  # it would be its own thermometer
        if pattern.joint not in of_joint:
            weights = solve_covariance(spread + _free(patterns, pattern.joint), warmth)
            of_joint[pattern.joint] = -(sigma**2) * (values - values[0]) @ weights
        found[:, k] = of_joint[pattern.joint]
    return found


def _free(patterns: Sequence[Pattern], joint: int | None) -> FloatArray:
    """(b, b) of a joint's friction that may be anything; zeros for no joint."""
    size = patterns[0].directions.shape[0]
    free = np.zeros((size, size))
    for pattern in patterns:
        if joint is not None and pattern.joint == joint and "friction" in pattern.effect and pattern.scale:
            direction = _ANYTHING * pattern.scale * pattern.directions[:, 0]
            free += np.outer(direction, direction)
    return free
