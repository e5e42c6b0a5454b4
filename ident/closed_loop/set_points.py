"""What the drives make of the recorded targets between two of them."""

from __future__ import annotations

import numpy as np

from robots.arrays import FloatArray
from robots.description import Robot


def set_points(
    robot: Robot, reference: FloatArray, period: float, per_sample: int
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
    """
    samples, n = reference.shape
    previous = np.concatenate([reference[:1], reference[:-1]])
    before = np.concatenate([previous[:1], previous[:-1]])
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
