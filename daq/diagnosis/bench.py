"""The arm of a live diagnosis: each motion asked for, driven at the speed the arm has passed, recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.catalogue.database import Catalogue
from daq.session.bench import ArmOrder, OpenArm
from daq.session.cell import Cell
from daq.session.estimates import estimate, require_room
from daq.session.motion_words import legs_of, motion_question
from daq.session.motions import move_to, refuse_undrivable, slowed
from daq.session.recorded_runs import Conducting, Recording, require_completed
from daq.session.session_error import NotMoved
from daq.session.watching import Watcher
from trajectories import Trajectory

STAGE = "diagnosis"
"""Of the runs in the catalogue that a live diagnosis has made."""


@dataclass(frozen=True)
class LiveArm:
    """An open arm that moves for a diagnosis.

    Attributes:
        arm: open, for the length of the diagnosis.
        order: which one it is.
        catalogue: where its runs are kept; nowhere where None.
        cell: what its motions keep clear of.
        confirm: asked before each motion, with what the arm is going to do.
        watcher, conducting: see the streams, and conduct them.
        note: the operator's.
    """

    arm: OpenArm
    order: ArmOrder
    catalogue: Catalogue | None
    cell: Cell
    confirm: Callable[[str], bool]
    watcher: Watcher
    conducting: Conducting
    note: str = ""

    def drive(self, trajectory: Trajectory, path: Path, purpose: str) -> Path:
        """Ask, move slowly to where the motion begins, then stream and record the motion.

        Args:
            trajectory: begins and ends at rest; driven slower where the arm has not passed its speed.
            path: of the capture; the way to its start goes into one beside it, ``<name>-approach.mcap``.
            purpose: in words, behind "the motion".

        Raises:
            NotMoved: it was not confirmed.
            SessionError, TrajectoryError: it must not be driven, or no way leads to its start.
            BusError, DriveError, CaptureError, RunInterrupted, RunFailed: as in ``armhil run``.
        """
        robot = self.order.robot
        trajectory = slowed(trajectory, self.arm.admission.slower(robot, trajectory))
        refuse_undrivable(robot, trajectory, path, self.cell)
        way = move_to(self.arm, np.asarray(trajectory.position[0]), self.cell)
        require_room(path.parent, estimate(robot, trajectory.duration))
        if not self.confirm(motion_question(robot, legs_of(f"the motion {purpose}", trajectory, way))):
            raise NotMoved(f"the motion {purpose} was not confirmed")
        recording = Recording(self.arm, self.order, self.catalogue, self.watcher, self.conducting, self.note)
        facts = {"cell_sha256": self.cell.sha256} if self.cell.sha256 else None
        if way is not None:
            beside = path.with_name(f"{path.stem}-approach{path.suffix}")
            _, result = recording.record("run", "Approach", way, beside, stage="approach", facts=facts)
            require_completed(result, beside)
        _, result = recording.record("run", path.stem, trajectory, path, stage=STAGE, facts=facts)
        require_completed(result, path)
        return path
