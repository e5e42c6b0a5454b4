"""``armhil commission``: walk an arm from a plan to its first full run, one stage after the other."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.catalogue.kept_run import kept_run, trajectory_words
from daq.doctor.doctor import examine
from daq.session.admission import SPEED
from daq.session.attestation import attested_words
from daq.session.bench import OpenArm, opened
from daq.session.dry_run import CommissionRequest, Planned
from daq.session.first_stage import first_legs, first_move, refuse_doubtful_gains
from daq.session.motion_words import legs_of, motion_question, speed_share
from daq.session.motions import move_to, slowed
from daq.session.recorded_runs import Conducting, Recording, require_completed
from daq.session.session_error import NotMoved, SessionError
from daq.session.stages import (
    LAST_BEFORE_USE,
    PURPOSES,
    TRAJECTORY_FILE,
    StageName,
    changed_since,
    fingerprint,
    stages_to_do,
    status,
)
from daq.session.streaming import Watcher
from daq.session.warm_up import warm_up
from daq.text.progress import Steps
from trajectories import Trajectory


@dataclass(frozen=True)
class StageDone:
    """A stage that was gone through; ``run`` is its number in the catalogue."""

    name: StageName
    words: str
    run: int | None
    capture: Path | None


def commission(
    request: CommissionRequest, planned: Planned, steps: Steps, watcher: Watcher, conducting: Conducting
) -> tuple[StageDone, ...]:
    """Go through the stages that are to be done, until one does not pass.

    Raises:
        BusError, DriveError, ArmMismatch, LeaseHeld: the arm cannot be had.
        CaptureError: a recording cannot be written.
        SessionError: a stage is locked or did not pass.
        NotMoved: a stage was not confirmed; those before it have passed.
    """
    with opened(request.arm, request.catalogue, steps, "commission", request.cell) as arm:
        states = status(request.catalogue, arm.identity, planned.sha256, request.cell.sha256)
        todo = stages_to_do(states, request.first, request.last)
        walk = Walk(request, planned, arm, steps, watcher, conducting)
        return tuple(walk.through(name) for name in todo)


@dataclass(frozen=True)
class Walk:
    """One walk through the stages with one open arm."""

    request: CommissionRequest
    planned: Planned
    arm: OpenArm
    steps: Steps
    watcher: Watcher
    conducting: Conducting

    def through(self, name: StageName) -> StageDone:
        """Go through a stage.

        Raises:
            SessionError: it did not pass.
        """
        if name == "plan":
            words = f"{trajectory_words(self.planned.trajectory)}, {self.planned.file}"
            changed = changed_since(self.request.catalogue, self.arm.identity)
            return self._keep_still(name, f"{words}; the description: {changed}" if changed else words)
        if name == "check":
            return self._keep_still(name, self._check())
        if name == "first move":
            return self._keep_still(name, self._first_move())
        motion = self.motion(name)
        if motion is None:
            return self._keep_still(name, "the arm stands there already")
        if name not in ("approach", "return"):
            self._go_to_start()
        return self._drive(name, motion)

    @property
    def _fingerprint(self) -> dict[str, str]:
        return fingerprint(self.arm.identity, self.planned.sha256, self.request.cell.sha256)

    def motion(self, name: StageName) -> Trajectory | None:
        """What a stage that moves drives, clear of the cell; None where the arm stands there already."""
        robot, trajectory = self.request.arm.robot, self.planned.trajectory
        start, cell = np.asarray(trajectory.position[0]), self.request.cell
        if name == "approach":
            return move_to(self.arm, start, cell)
        if name == "return":
            return move_to(self.arm, np.array(robot.home), cell)
        if name == "warm-up":
            return warm_up(robot, start, cell, self.request.rounds)
        return slowed(trajectory, self.request.slow_speed) if name == "slow run" else trajectory

    def _first_move(self) -> str:
        request, robot = self.request, self.request.arm.robot
        refuse_doubtful_gains(self.arm, request.looked)
        legs = first_legs(robot, np.asarray(self.arm.session.actual_position()), request.cell)
        if not request.confirm(motion_question(robot, legs, "Stage first move: ")):
            raise NotMoved("stage first move was not confirmed; what passed before it is kept")
        return first_move(
            self.arm,
            self._recording(),
            lambda name: _free(request.folder, f"first-move-{name.replace(' ', '-')}"),
            self._fingerprint,
            request.looked,
        )

    def _go_to_start(self) -> None:
        """Where the arm was moved since its approach, it approaches again."""
        way = move_to(self.arm, np.asarray(self.planned.trajectory.position[0]), self.request.cell)
        if way is not None:
            self._drive("approach", way)

    def _drive(self, name: StageName, motion: Trajectory) -> StageDone:
        robot = self.request.arm.robot
        legs = legs_of(f"{PURPOSES[name]} ({trajectory_words(motion)})", motion, None)
        if not self.request.confirm(motion_question(robot, legs, f"Stage {name}: ")):
            raise NotMoved(f"stage {name} was not confirmed; what passed before it is kept")
        request = self.request
        path = _free(request.folder, name.replace(" ", "-"))
        facts = self._fingerprint | {SPEED: f"{speed_share(robot, motion):.6f}"}
        if name == LAST_BEFORE_USE:
            facts[TRAJECTORY_FILE] = str(self.planned.file.absolute())
        kept, result = self._recording().record(
            "commission",
            f"{request.arm.robot.name}: {name}",
            motion,
            path,
            stage=name,
            facts=facts,
        )
        require_completed(result, path)
        return StageDone(name, f"{trajectory_words(motion)}", kept.number, path)

    def _recording(self) -> Recording:
        of = self.request
        return Recording(self.arm, of.arm, of.catalogue, self.watcher, self.conducting, of.note, of.celsius)

    def _check(self) -> str:
        """Machine, bus and drives; the drives have answered and agree with the description already.

        Raises:
            SessionError: the machine is unfit, or nobody has said where the arm stands.
        """
        found = examine(self.request.arm.robot)  # the bus is ours: the drives have answered on it
        failed = [check for check in found if check.status == "failed"]
        if failed:
            raise SessionError(
                f"stage check: {failed[0].name}: {failed[0].detail}; {failed[0].remedy}; see `armhil doctor`"
            )
        doubtful = [check.name for check in found if check.status != "ok"]
        serials = ", ".join("?" if s is None else str(s) for s in self.arm.identity.serials)
        rest = f"look at {', '.join(doubtful)}" if doubtful else "all is well"
        posture = attested_words(self.request.catalogue, self.arm.identity, self.request.arm)
        return f"drives {serials}; {posture}; {rest}"

    def _keep_still(self, name: StageName, words: str) -> StageDone:
        """Keep a stage that moved nothing."""
        facts = {"channel": str(self.request.arm.channel), "found": words}
        facts |= self._fingerprint
        with kept_run(
            self.request.catalogue,
            self.arm.identity,
            "commission",
            stage=name,
            trajectory=trajectory_words(self.planned.trajectory),
            facts=facts,
            note=self.request.note,
        ) as kept:
            kept.outcome = "completed"
        return StageDone(name, words, kept.number, None)


def _free(folder: Path, name: str) -> Path:
    """A file of that name that is not there yet: nothing is ever overwritten."""
    number = 1
    path = folder / f"{name}.mcap"
    while path.exists():
        number += 1
        path = folder / f"{name}-{number}.mcap"
    return path
