"""What the drives make of the recorded targets between two of them."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray
from robots.description import Robot


def set_points(
    robot: Robot, reference: FloatArray, period: float, per_sample: int, moving: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Set-point and its velocity at every controller sample, (samples · per_sample, n) each.

    ``hold``: the target of this sample. ``linear``: the way from the previous target to this one, which
    takes a whole period. ``spline``: the uniform quadratic B-spline over the last three targets, whose
    velocity is continuous.

    Args:
        robot: its controller says which.
        reference: (samples, n) targets, of joints or of drives.
        period: of the targets, s.
        per_sample: controller samples per target.
        moving: whether the targets before the first went on as the first three do; else they stood still.
    """
    samples, n = reference.shape
    before, previous = _two_before(reference, moving)
    last, rate = (previous - before) / period, (reference - previous) / period
    share = (np.arange(per_sample) / per_sample)[np.newaxis, :, np.newaxis]
    previous, before, last, rate = (a[:, np.newaxis] for a in (previous, before, last, rate))
    speed = np.broadcast_to(rate, (samples, per_sample, n))
    if robot.controller.interpolation == "hold":
        points = np.broadcast_to(reference[:, np.newaxis], speed.shape)
    elif robot.controller.interpolation == "linear":
        points = previous + share * (reference[:, np.newaxis] - previous)
    else:
        speed = last + share * (rate - last)
        points = 0.5 * (before + previous) + 0.5 * share * period * (last + speed)
    return points.reshape(-1, n), speed.reshape(-1, n)


def set_point_accelerations(
    reference: FloatArray, period: float, per_sample: int, moving: bool = False
) -> FloatArray:
    """Acceleration of the set-points at every controller sample, (samples · per_sample, n).

    The second difference of the targets, held for a period; arguments as of :func:`set_points`.
    """
    before, previous = _two_before(reference, moving)
    return np.repeat((reference - 2 * previous + before) / period**2, per_sample, axis=0)


def _two_before(reference: FloatArray, moving: bool) -> tuple[FloatArray, FloatArray]:
    """The targets two and one before each, (samples, n) each."""
    earlier = np.repeat(reference[:1], 2, axis=0)
    if moving:
        first, second, third = reference[:3]
        earlier = np.array([6 * first - 8 * second + 3 * third, 3 * (first - second) + third])
    previous = np.concatenate([earlier[1:], reference[:-1]])
    return np.concatenate([earlier[:1], previous[:-1]]), previous
