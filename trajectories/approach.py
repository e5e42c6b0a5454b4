"""A plain move from rest to rest, as on the way to where an experiment starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.collision import CollisionCheck
from trajectories.errors import TrajectoryError
from trajectories.limits import Limits, Margins, kinematic_use, require_posture, require_within
from trajectories.segments import SHORTEST, PiecewiseJerk, SegmentPlanner, Waypoint, hold
from trajectories.surroundings import Surroundings
from trajectories.torque import TorqueCheck
from trajectories.trajectory import Detail, Trajectory

SLOWER = 0.8
SLOWEST = 0.02


def approach(
    robot: Robot,
    start: ArrayLike,
    goal: ArrayLike,
    cycle_time: float,
    speed_factor: float = 0.3,
    surroundings: Surroundings | None = None,
) -> Trajectory:
    """The jerk-limited move from rest at ``start`` to rest at ``goal``, all joints arriving together.

    Where the motors could not follow it, it is made slower until they can.

    Args:
        robot: the arm.
        start, goal: postures (n,), rad (or m).
        cycle_time: of the samples, s.
        surroundings: what the arm may not touch; only itself where not given.
        speed_factor: as if time were stretched by 1/factor: velocities times factor, jerks times factor³.

    Raises:
        TrajectoryError: when an end is outside the position limits, or a posture on the way needs more
            torque than the motors have, or comes too close to something; names constraint, joint and time.
    """
    start, goal = np.asarray(start, dtype=np.float64), np.asarray(goal, dtype=np.float64)
    collision = CollisionCheck(robot, surroundings or Surroundings())
    absolute = Limits.of(robot, Margins(position=0.0))
    require_posture(start, absolute, "start")
    require_posture(goal, absolute, "goal")
    factor = speed_factor
    while True:
        limits = Limits.of(robot, Margins(speed_factor=factor)).widened(start).widened(goal)
        motion = straight_move(start, goal, limits)
        uses = kinematic_use(motion, limits) + TorqueCheck.of(robot, limits).use(motion)
        try:
            require_within(uses, limits.names)
        except TrajectoryError as error:
            if "torque" not in error.constraint or factor * SLOWER < SLOWEST:
                raise
            factor *= SLOWER
            continue
        nearest = collision.require_clear(motion, "the move")
        return Trajectory.sampled(
            motion, cycle_time, family="move", detail=Detail(uses=uses, nearest=nearest)
        )


def straight_move(start: FloatArray, goal: FloatArray, limits: Limits) -> PiecewiseJerk:
    """From rest to rest by ruckig; a standstill where there is no way to go.

    Raises:
        TrajectoryError: when ruckig finds no motion within the limits.
    """
    motion = SegmentPlanner(limits).connect(Waypoint.at_rest(start), Waypoint.at_rest(goal))
    if motion is not None:
        return motion
    if np.allclose(start, goal, atol=1e-9):
        return hold(goal, SHORTEST)
    joint = int(np.argmax(np.abs(goal - start)))
    raise TrajectoryError(
        f"no move from {start[joint]:.6g} to {goal[joint]:.6g} keeps the limits",
        constraint="position",
        joint=limits.names[joint],
    )
