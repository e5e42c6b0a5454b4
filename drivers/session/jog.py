"""One joint, a short way, slowly: the motion of commissioning."""

from __future__ import annotations

import numpy as np

from drivers.cyclic.ramp import approach
from drivers.errors import DriveError
from drivers.frames.samples import Samples
from robots.arrays import FloatArray
from robots.description import Robot

JOG_SHARE = 0.1
"""Largest share of a joint's velocity and acceleration limits."""


def ignore_samples(samples: Samples) -> None:
    """For motions whose samples nobody wants."""


def jog_path(
    robot: Robot, start: FloatArray, joint: str, distance: float, share: float = JOG_SHARE
) -> FloatArray:
    """Set-points that move one joint from rest to rest; the others stay.

    Args:
        robot: with limits and cycle time.
        start: (n,) where the arm stands, rad or m.
        joint: name.
        distance: rad or m.
        share: of the limits, above 0 and at most JOG_SHARE.

    Returns:
        N × n, the first row is ``start``.

    Raises:
        DriveError: no such joint, a share that is not allowed, or an end outside the joint's limits.
    """
    names = [each.name for each in robot.joint]
    if joint not in names:
        raise DriveError(f"no joint {joint!r} to jog; allowed: {', '.join(names)}")
    if not 0 < share <= JOG_SHARE:
        raise DriveError(f"jog at {share:g} of the limits; allowed: above 0, at most {JOG_SHARE:g}")
    index = names.index(joint)
    end = np.array(start, dtype=np.float64)
    end[index] += distance
    lower, upper = robot.joint[index].position
    if not np.isfinite(distance) or not lower <= end[index] <= upper:
        raise DriveError(
            f"jog of joint {joint} would end at {end[index]:.6g}; allowed: {lower:g} to {upper:g}"
        )
    # The approach keeps to a share of its own.
    scale = share / JOG_SHARE
    limits = robot.velocity_limits * scale, robot.acceleration_limits * scale
    way = approach(np.asarray(start), end, *limits, robot.bus.cycle_time)
    return np.vstack([start, way])
