"""Motions that the master makes by itself: a stop, and the way onto a reference's first point."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray

GENTLE = 0.1
"""Share of the limits that the way onto the first point may use."""


def stop_ramp(
    previous: FloatArray, last: FloatArray, acceleration: FloatArray, cycle_time: float
) -> FloatArray:
    """Targets that bring each joint to rest along its own velocity, at its acceleration limit.

    The velocity is that of the last two targets, so position and velocity go on without a step, and no
    second difference is above the limit. Each joint stops on its own in the shortest way: a reference that
    can stop inside the limits does not leave them.

    Args:
        previous, last: (n,) the last two targets, rad or m.
        acceleration: (n,) limits.
        cycle_time: s.

    Returns:
        M × n targets after ``last``, the final one at rest; M = 0 where all joints stand.
    """
    speed = np.abs(last - previous) / cycle_time
    per_cycle = acceleration * cycle_time
    steps = int(np.max(np.ceil(speed / per_cycle - 1e-9)))
    decrements = np.arange(1, steps + 1)[:, None] * per_cycle
    speeds = np.maximum(speed - decrements, 0.0)
    return np.asarray(last + np.sign(last - previous) * np.cumsum(speeds, axis=0) * cycle_time)


def approach(
    start: FloatArray, end: FloatArray, velocity: FloatArray, acceleration: FloatArray, cycle_time: float
) -> FloatArray:
    """Rest to rest from the held position to a reference's first point, along a quintic.

    The quintic 10s³ − 15s⁴ + 6s⁵ has peak velocity 15/8 and peak acceleration 10/√3 per unit of way and time.

    Args:
        start, end: (n,) rad or m.
        velocity, acceleration: (n,) limits, of which a tenth is used.
        cycle_time: s.

    Returns:
        M × n targets after ``start``, the last one is ``end``.
    """
    way = np.abs(end - start)
    by_velocity = 1.875 * way / (GENTLE * velocity)
    by_acceleration = np.sqrt(10 / np.sqrt(3) * way / (GENTLE * acceleration))
    duration = float(max(by_velocity.max(), by_acceleration.max()))
    steps = max(1, int(np.ceil(duration / cycle_time)))
    s = np.arange(1, steps + 1)[:, None] / steps
    return np.asarray(start + (10 * s**3 - 15 * s**4 + 6 * s**5) * (end - start))
