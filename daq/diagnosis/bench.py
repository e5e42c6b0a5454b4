"""The arm on its bench, real or simulated: stream a motion and record it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.progress import Steps
from daq.session.cell import Cell
from daq.session.motions import slow_way
from daq.session.recorded_runs import Conducting, require_completed, unconducted
from daq.session.streaming import StreamOrder, stream_recorded
from daq.session.watching import StepBar
from drivers import ArmSession, Channel
from robots import Robot
from trajectories import Conditions, Trajectory
from trajectories.plan import APPROACH_SPEED

_AT_START = 1e-3
"""rad or m; nearer than this the arm stands where a motion begins."""


def stream_and_record(
    robot: Robot,
    channel: Channel,
    trajectory: Trajectory,
    conditions: Conditions,
    path: Path,
    steps: Steps,
    conducting: Conducting = unconducted,
) -> Path:
    """Move to where the motion begins, slowly, then stream the motion; both are recorded.

    As in every run, what surrounds a fault is kept as a capture of its own, and others can look on.

    Args:
        robot: the arm.
        channel: where its drives are.
        trajectory: begins and ends at rest.
        conditions: what the way to its start has to keep.
        path: of the capture; the way to its start goes into one beside it, ``<name>-approach.mcap``.
        steps: told what happens.
        conducting: gives the conduct of each stream.

    Raises:
        BusError, DriveError: the bus is occupied, or a drive refuses.
        TrajectoryError: no way leads to the start of the motion.
        CaptureError: the recording cannot be written.
        RunInterrupted: stopped on request.
        RunFailed: the arm ended the run itself.
    """
    with ArmSession(robot, channel) as session:
        actual = session.actual_position()
        if np.abs(actual - trajectory.position[0]).max() > _AT_START:
            way = slow_way(robot, actual, trajectory.position[0], APPROACH_SPEED, Cell(conditions))
            beside = path.with_name(f"{path.stem}-approach{path.suffix}")
            _drive(session, "Move to where the motion begins", way, beside, steps, conducting)
        _drive(session, f"Stream and record {path.name}", trajectory, path, steps, conducting)
    return path


def _drive(
    session: ArmSession, title: str, motion: Trajectory, path: Path, steps: Steps, conducting: Conducting
) -> None:
    order = StreamOrder(title, motion, path, {"kind": "diagnosis"})
    with steps.step(title) as update, conducting() as conduct:
        result = stream_recorded(session, order, StepBar(update), conduct)
    require_completed(result, path)
