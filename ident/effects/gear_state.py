"""The state of a gear that is not rigid: how far the link is behind its drive, along a measured motion.

With x the lag of the link behind the drive's output, m the inertia of the links that the drive moves and
τ the torque that the same motion takes of rigid links,

    m ẍ + D ẋ + K·play(x) = τ

where play takes the gap off the spring's way. The encoder sits on the drive, so the drive's motion is what
was measured, and x follows from it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from robots.arrays import FloatArray

_SUBSTEP = 2.5e-4
"""s; of the integration."""


def lag_of_link(
    inertia: FloatArray,
    load: FloatArray,
    sample_time: float,
    stiffness: float,
    damping: float,
    gap: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lag of the link behind the drive and its first two derivatives, each (samples,), rad (or m) and s.

    Args:
        inertia: (samples,) of the links that the drive moves, at its output, kg·m² (or kg).
        load: (samples,) torque that rigid links would take, N·m (or N).
        sample_time: s.
        stiffness: N·m/rad (or N/m).
        damping: N·m·s/rad (or N·s/m), acts where the spring does.
        gap: rad (or m), the whole play; the link starts in contact on the side that its load presses it to.
    """
    lag, rate, push = (np.empty_like(load) for _ in range(3))
    substeps = max(1, int(np.ceil(sample_time / _SUBSTEP)))
    start = load[0] / stiffness + 0.5 * gap * np.sign(load[0])
    _kernel()(
        inertia, load, sample_time / substeps, substeps, stiffness, damping, gap, start, lag, rate, push
    )
    return lag, rate, push


@cache
def _kernel() -> Callable[..., None]:
    """The integration in machine code."""
    import numba  # takes a second to load; most commands need no gear state

    compiled: Callable[..., None] = numba.njit(error_model="numpy", nogil=True)(_run)
    return compiled


def _run(
    inertia: FloatArray,
    load: FloatArray,
    h: float,
    substeps: int,
    stiffness: float,
    damping: float,
    gap: float,
    start: float,
    lag: FloatArray,
    rate: FloatArray,
    push: FloatArray,
) -> None:
    """Implicit Euler; the branch of the play is taken from a trial step. Writes lag, rate and push."""
    x, v = start, 0.0
    half = 0.5 * gap
    for k in range(load.shape[0]):
        nearer = min(k + 1, load.shape[0] - 1)
        for s in range(substeps):
            ahead = s / substeps
            m = inertia[k] + ahead * (inertia[nearer] - inertia[k])
            f = load[k] + ahead * (load[nearer] - load[k])
            # Free flight first; then, where that ends beyond the gap, the spring's implicit step.
            w = v + h * f / m
            y = x + h * w
            if y > half or y < -half:
                edge = half if y > half else -half
                w = (m * v + h * (f - stiffness * (x - edge))) / (m + h * damping + h * h * stiffness)
                y = x + h * w
            if s == 0:
                lag[k], rate[k], push[k] = x, v, (w - v) / h
            x, v = y, w
