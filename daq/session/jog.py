"""``armhil jog``: one joint a little further, slowly, for the first looks at an arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from daq.catalogue.database import Catalogue
from daq.session.bench import ArmOrder, opened
from daq.session.cell import Cell
from daq.session.estimates import estimate, require_room
from daq.session.joints import distance_of, joint_index, shown
from daq.session.motion_words import legs_of, motion_question
from daq.session.motions import slow_way
from daq.session.recorded_runs import Conducting, Recording
from daq.session.session_error import NotMoved, SessionError
from daq.session.streaming import Watcher
from daq.text.progress import Steps
from drivers import StreamResult
from drivers.session.jog import JOG_SHARE
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Trajectory, TrajectoryError

_STILL = 1e-9
"""rad or m: by less than this a joint does not move."""


@dataclass(frozen=True)
class HandRequest:
    """What every way to move an arm by hand takes.

    Attributes:
        arm: which arm, where.
        folder: where recordings go; exists and is writable.
        speed: share of a joint's speed, at most a tenth.
        cell: what the motion has to keep clear of.
        note: the operator's.
        catalogue: where it is kept; nowhere where None.
        confirm: asked just before the arm moves, with what it is going to do; False means it stays.
    """

    arm: ArmOrder
    folder: Path
    speed: float = JOG_SHARE
    cell: Cell = field(default_factory=Cell)
    note: str = ""
    catalogue: Catalogue | None = None
    confirm: Callable[[str], bool] = lambda question: True

    def __post_init__(self) -> None:
        """Raises SessionError where the speed is none to jog at."""
        if not 0.0 < self.speed <= JOG_SHARE:
            raise SessionError(f"--speed {self.speed:g}; allowed: above 0, up to {JOG_SHARE:g}")


@dataclass(frozen=True, kw_only=True)
class JogRequest(HandRequest):
    """A joint, number (from 1) or name, and how far, signed; see :func:`daq.session.joints.distance_of`."""

    joint: str
    by: str


@dataclass(frozen=True)
class JogResult:
    """What came of it; ``run`` is its number in the catalogue, positions are rad or m."""

    joint: str
    start: float
    end: float
    capture: Path
    stream: StreamResult
    run: int | None


def jog(request: JogRequest, steps: Steps, watcher: Watcher, conducting: Conducting) -> JogResult:
    """Plan the way of one joint, judge it, ask, stream, record.

    Raises:
        SessionError: there is no such joint or way, or no room on the disk.
        TrajectoryError: the way leaves a limit, or something is in it.
        BusError, DriveError, ArmMismatch, LeaseHeld: the arm cannot be had.
        CaptureError: the recording cannot be written.
        NotMoved: it was not confirmed.
    """
    robot = request.arm.robot
    axis = joint_index(robot, request.joint)
    distance = distance_of(robot, axis, request.by)
    name = robot.joint[axis].name
    with opened(request.arm, request.catalogue, steps, "drive", request.cell) as arm:
        start = arm.session.actual_position()
        motion = jog_motion(robot, start, axis, distance, request.speed, request.cell)
        arm.admission.admit(robot, motion)
        wanted = estimate(robot, motion.duration)
        require_room(request.folder, wanted)
        end = float(motion.position[-1, axis])
        what = f"{name} from {shown(robot, axis, float(start[axis]))} to {shown(robot, axis, end)}"
        if not request.confirm(motion_question(robot, legs_of(what, motion, None))):
            raise NotMoved("not confirmed, nothing moved")
        recording = Recording(arm, request.arm, request.catalogue, watcher, conducting, request.note)
        path = request.folder / "capture.mcap"
        kept, result = recording.record("run", f"Jog {name}", motion, path, stage="jog")
        return JogResult(name, float(start[axis]), end, path, result, kept.number)


def jog_motion(
    robot: Robot, start: FloatArray, axis: int, distance: float, speed: float, cell: Cell | None = None
) -> Trajectory:
    """One joint from rest to rest, within every limit and clear of everything; the others stay.

    Args:
        robot: the arm.
        start: (n,) where it stands, rad or m.
        axis: which joint, from 0.
        distance: rad or m, signed.
        speed: share of the joint's speed.
        cell: what it has to keep clear of; only the arm itself where None.

    Raises:
        TrajectoryError: the end is outside the limits, or something is in the way.
        SessionError: the joint would only get there together with others.
    """
    goal = np.array(start, dtype=np.float64)
    goal[axis] += distance
    try:
        motion = slow_way(robot, start, goal, speed, cell)
    except TrajectoryError as refusal:
        if refusal.constraint == "position" and not robot.lower[axis] <= goal[axis] <= robot.upper[axis]:
            raise SessionError(
                f"joint {robot.joint[axis].name} would end at {shown(robot, axis, float(goal[axis]))};"
                f" allowed: {robot.lower[axis]:g} to {robot.upper[axis]:g}"
            ) from refusal
        raise
    others = np.arange(robot.n) != axis
    if np.ptp(motion.position, axis=0)[others].max(initial=0.0) > _STILL:
        raise SessionError(f"joint {robot.joint[axis].name} cannot go there alone: something is in its way")
    return motion
