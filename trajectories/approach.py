"""A plain move from rest to rest, as on the way to where an experiment starts."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.constraints.surroundings import Surroundings
from trajectories.constraints.tool_speed import Tool
from trajectories.errors import TrajectoryError
from trajectories.judgement import Conditions, Judge, Judgement
from trajectories.limits import Limits, Margins, require_posture
from trajectories.motions.motion import Motion
from trajectories.motions.segments import SHORTEST, PiecewiseJerk, SegmentPlanner, Waypoint, hold, join
from trajectories.trajectory import Detail, Trajectory

SLOWER = 0.8
SLOWEST = 0.02

APPROACH_SPEED = 0.3
"""Speed factor of the move from where the arm is to where the exciting motion begins."""

DETOURS = 60
"""Postures that are tried on the way where the straight way is blocked."""

HALVINGS = 9
"""Of the way to a limit until it is known what part of it is clear: to 0.2 % of it."""


def approach(
    robot: Robot,
    start: ArrayLike,
    goal: ArrayLike,
    cycle_time: float,
    speed_factor: float = 0.3,
    surroundings: Surroundings | None = None,
    tool: Tool | None = None,
    tool_speed: float | None = None,
) -> Trajectory:
    """The jerk-limited move from rest at ``start`` to rest at ``goal``, all joints arriving together.

    Where the motors could not follow it, or the tool would be too fast, it is made slower. Where something
    is in the way, it goes over another posture, with a stop there.

    Args:
        robot: the arm.
        start, goal: postures (n,), rad (or m).
        cycle_time: of the samples, s.
        speed_factor: as if time were stretched by 1/factor: velocities times factor, jerks times factor³.
        surroundings: what the arm may not touch; only itself where not given.
        tool: whose speed is watched; the last link where not given.
        tool_speed: highest allowed, m/s; None for no limit.

    Raises:
        TrajectoryError: when an end is outside the position limits, or a posture on the way needs more
            torque than the motors have, or comes too close to something and no detour was found; names
            constraint, joint and time.
    """
    start, goal = np.asarray(start, dtype=np.float64), np.asarray(goal, dtype=np.float64)
    limits = _limits(robot, start, goal, speed_factor)
    judge = Judge(robot, limits, surroundings, tool, tool_speed)
    for name, posture in (("start", start), ("goal", goal)):
        judge.collision.require_clear_posture(posture, name)
    refusal: TrajectoryError | None = None
    for stops in _ways(judge, start, goal):
        try:
            motion, judgement = _slow_enough(judge, stops, speed_factor)
        except TrajectoryError as error:
            refusal = refusal or error
            if error.constraint != "collision":
                break
            continue
        return _sampled(motion, judgement, cycle_time)
    raise refusal or TrajectoryError("there is no way to the goal", constraint="collision")


def as_far_as_clear(
    robot: Robot,
    start: ArrayLike,
    goal: ArrayLike,
    cycle_time: float,
    speed_factor: float,
    conditions: Conditions,
) -> Trajectory:
    """The straight way from rest at ``start`` towards ``goal``, to its end or to what is in the way.

    Args:
        robot: the arm.
        start, goal: postures (n,), rad (or m).
        cycle_time: of the samples, s.
        speed_factor: as in :func:`approach`.
        conditions: what the arm may not touch, and how fast the tool may be.

    Raises:
        TrajectoryError: an end is outside the position limits, or no part of the way is clear.
    """
    start, goal = np.asarray(start, dtype=np.float64), np.asarray(goal, dtype=np.float64)
    limits = _limits(robot, start, goal, speed_factor)
    judge = Judge(robot, limits, conditions.surroundings, conditions.tool, conditions.tool_speed)

    def reach(share: float) -> Trajectory:
        motion, judgement = _slow_enough(judge, (start, start + share * (goal - start)), speed_factor)
        return _sampled(motion, judgement, cycle_time)

    try:
        return reach(1.0)
    except TrajectoryError as error:
        refusal = error
    clear, share, blocked = None, 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (share + blocked) / 2.0
        try:
            clear, share = reach(middle), middle
        except TrajectoryError:
            blocked = middle
    if clear is None:
        raise refusal
    return clear


def _limits(robot: Robot, start: FloatArray, goal: FloatArray, speed_factor: float) -> Limits:
    """Of a move between two postures, which are within the arm's own limits.

    Raises:
        TrajectoryError: one of them is not.
    """
    absolute = Limits.of(robot, Margins(position=0.0))
    require_posture(start, absolute, "start")
    require_posture(goal, absolute, "goal")
    return Limits.of(robot, Margins(speed_factor=speed_factor)).widened(start).widened(goal)


def _sampled(motion: PiecewiseJerk, judgement: Judgement, cycle_time: float) -> Trajectory:
    detail = Detail(uses=judgement.uses, nearest=judgement.nearest, tool=judgement.tool)
    return Trajectory.sampled(motion, cycle_time, family="move", detail=detail)


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


def _ways(judge: Judge, start: FloatArray, goal: FloatArray) -> Iterator[tuple[FloatArray, ...]]:
    """The straight way, then ways over home and over postures that are themselves clear."""
    yield start, goal
    generator = np.random.default_rng(0)
    limits = judge.limits
    for k in range(DETOURS):
        middle = np.array(judge.robot.home) if k == 0 else generator.uniform(limits.lower, limits.upper)
        if judge.collision.allows(hold(middle, SHORTEST)):
            yield start, middle, goal


def _slow_enough(judge: Judge, stops: Sequence[FloatArray], factor: float) -> tuple[PiecewiseJerk, Judgement]:
    """The move over postures, slowed down until motors and tool allow it.

    Raises:
        TrajectoryError: what it breaks however slow it is.
    """
    share = 1.0
    while True:
        limits = judge.limits.at_speed(share)
        motion = join([straight_move(a, b, limits) for a, b in itertools.pairwise(stops)])
        judgement = judge.judge(motion)
        if not judgement.problems:
            return motion, judgement
        slower = all("torque" in p.constraint or p.constraint == "tool speed" for p in judgement.problems)
        if not slower or factor * share * SLOWER < SLOWEST:
            raise judgement.problems[0]
        share *= SLOWER


def lead_home(
    robot: Robot, start: FloatArray | None, cycle_time: float, conditions: Conditions
) -> Motion | None:
    """The slow move from a start (n,) to home; None where the arm is there already.

    Raises:
        TrajectoryError: the start breaks a constraint, or every way home that was tried does.
    """
    if start is None:
        return None
    slowest = min(APPROACH_SPEED, conditions.margins.speed_factor)
    return approach(
        robot,
        start,
        robot.home,
        cycle_time,
        slowest,
        conditions.surroundings,
        conditions.tool,
        conditions.tool_speed,
    ).motion


def posture_of(robot: Robot, start: ArrayLike | None) -> FloatArray | None:
    """The start as an array; None for home.

    Raises:
        TrajectoryError: it is no posture of the arm, or outside its limits.
    """
    if start is None:
        return None
    posture = np.asarray(start, dtype=np.float64)
    require_posture(posture, Limits.of(robot, Margins(position=0.0)), "start")
    return None if np.allclose(posture, robot.home, atol=1e-9) else posture
