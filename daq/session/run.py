"""``armhil run``: stream one trajectory to an arm and record it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from daq.catalogue.database import Catalogue
from daq.catalogue.kept_run import trajectory_words
from daq.session.bench import ArmOrder, OpenArm, opened
from daq.session.cell import Cell
from daq.session.estimates import estimate, require_room
from daq.session.motion_words import legs_of, motion_question
from daq.session.motions import move_to, read_trajectory, refuse_undrivable
from daq.session.recorded_runs import Conducting, Recording, require_completed
from daq.session.session_error import NotMoved, SessionError
from daq.session.streaming import Watcher
from daq.text.progress import Steps
from drivers import StreamResult
from drivers.session.stream_job import START_TOLERANCE
from trajectories import Trajectory


@dataclass(frozen=True)
class RunRequest:
    """What to run.

    Attributes:
        arm: which arm, where.
        trajectory: file of the motion.
        folder: where the recordings go; exists and is writable.
        speed: below 1, the same path in 1/speed of the time.
        approach: go slowly to where the trajectory begins, if the arm stands elsewhere.
        note: the operator's.
        catalogue: where it is kept; nowhere where None.
        cell: what approach and trajectory have to keep clear of.
        confirm: asked just before the arm moves, with what it is going to do; False means it stays.
        celsius: of the hall, to be kept with the runs.
    """

    arm: ArmOrder
    trajectory: Path
    folder: Path
    speed: float = 1.0
    approach: bool = False
    note: str = ""
    catalogue: Catalogue | None = None
    cell: Cell = field(default_factory=Cell)
    confirm: Callable[[str], bool] = lambda question: True
    celsius: float | None = None


@dataclass(frozen=True)
class RunResult:
    """What came out; ``run`` is its number in the catalogue."""

    capture: Path
    stream: StreamResult
    run: int | None


def run_trajectory(request: RunRequest, steps: Steps, watcher: Watcher, conducting: Conducting) -> RunResult:
    """Read, judge, ask, stream, record.

    Raises:
        TrajectoryFileError, TrajectoryError: there is no such motion, or it must not be driven.
        BusError, DriveError, ArmMismatch, LeaseHeld: the arm cannot be had.
        CaptureError: the recording cannot be written.
        SessionError: no room on the disk, or the arm stands elsewhere.
        NotMoved: it was not confirmed.
    """
    robot = request.arm.robot
    trajectory = read_trajectory(request.trajectory, robot, request.speed)
    refuse_undrivable(robot, trajectory, request.trajectory, request.cell)
    require_room(request.folder, estimate(robot, trajectory.duration))
    with opened(request.arm, request.catalogue, steps, "drive", request.cell) as arm:
        arm.admission.admit(robot, trajectory)
        move = way_to(arm, trajectory, request.cell, allowed=request.approach)
        legs = legs_of(f"the motion ({trajectory_words(trajectory)})", trajectory, move)
        if not request.confirm(motion_question(robot, legs)):
            raise NotMoved("not confirmed, nothing moved")
        recording = Recording(
            arm, request.arm, request.catalogue, watcher, conducting, request.note, request.celsius
        )
        facts = {"cell_sha256": request.cell.sha256} if request.cell.sha256 else None
        if move is not None:
            path = request.folder / "approach.mcap"
            _, result = recording.record("run", "Approach", move, path, stage="approach", facts=facts)
            require_completed(result, path)
        path = request.folder / "capture.mcap"
        kept, result = recording.record("run", "Run", trajectory, path, facts=facts)
    return RunResult(path, result, kept.number)


def way_to(arm: OpenArm, trajectory: Trajectory, cell: Cell, *, allowed: bool) -> Trajectory | None:
    """The slow move to where a trajectory begins; None where the arm stands there.

    Raises:
        SessionError: the arm stands elsewhere and is not to go there.
        TrajectoryError: there is no way.
    """
    if not allowed:
        _require_start(arm, trajectory)
        return None
    return move_to(arm, np.asarray(trajectory.position[0]), cell)


def _require_start(arm: OpenArm, trajectory: Trajectory) -> None:
    actual, start = arm.session.actual_position(), np.asarray(trajectory.position[0])
    away = np.abs(actual - start)
    if (away > START_TOLERANCE).any():
        axis = int(np.argmax(away))
        raise SessionError(
            f"joint {arm.session.robot.joint[axis].name} stands at {actual[axis]:.6g} and the trajectory"
            f" begins at {start[axis]:.6g}; give --approach to go there slowly"
        )
