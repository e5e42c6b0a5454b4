"""The warm-up: each joint alone, a little there and back, slowly; wires, signs and brakes show themselves."""

from __future__ import annotations

import numpy as np

from daq.session.cell import Cell
from daq.session.motions import slow_way
from daq.session.stages import SLOW_SPEED
from robots import Robot
from robots.arrays import FloatArray
from trajectories import MotionSequence, Trajectory, TrajectoryError

SHARE = 0.05
"""Of a joint's travel that it goes, at most."""

MOST = 0.2
"""rad or m that it goes, at most."""

TRIES = 4
"""The way is halved so often where something is in it."""


def warm_up(robot: Robot, posture: FloatArray, cell: Cell | None = None, rounds: int = 1) -> Trajectory:
    """Each joint in turn from a posture to one beside it and back, at a tenth of the speed.

    It goes to the side on which there is more travel; less far, or to the other side, where something is in
    the way.

    Args:
        robot: the arm.
        posture: where it stands, (n,), rad or m.
        cell: what it may not touch; only itself where None.
        rounds: how often all joints take their turn.

    Raises:
        TrajectoryError: a joint can go nowhere.
    """
    parts = []
    for axis in range(robot.n):
        there, back = _beside(robot, posture, axis, cell)
        parts += [there.motion, back.motion]
    return Trajectory.sampled(
        MotionSequence(tuple(parts * rounds)), robot.bus.cycle_time, family="move", speed=SLOW_SPEED
    )


def _beside(robot: Robot, posture: FloatArray, axis: int, cell: Cell | None) -> tuple[Trajectory, Trajectory]:
    below, above = posture[axis] - robot.lower[axis], robot.upper[axis] - posture[axis]
    far = min(MOST, SHARE * float(robot.upper[axis] - robot.lower[axis]))
    first = 1.0 if above >= below else -1.0
    refusal: TrajectoryError | None = None
    for k in range(TRIES):
        for direction in (first, -first):
            goal = posture.copy()
            goal[axis] += direction * far / 2**k
            try:
                there = slow_way(robot, posture, goal, SLOW_SPEED, cell)
                back = slow_way(robot, goal, posture, SLOW_SPEED, cell)
            except TrajectoryError as error:
                refusal = refusal or error
                continue
            if np.ptp(there.position, axis=0)[np.arange(robot.n) != axis].max(initial=0.0) < 1e-9:
                return there, back  # a detour would move the other joints
    raise refusal or TrajectoryError(
        "there is no room to move it alone", constraint="collision", joint=robot.joint[axis].name
    )
