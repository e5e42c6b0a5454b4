"""``armhil commission``: walk an arm from a plan to its first full run, one stage after the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from daq.catalogue import arms
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_arm, sha256_of
from daq.catalogue.kept_run import kept_run, trajectory_words
from daq.catalogue.values import ArmIdentity
from daq.doctor import examine
from daq.files.trajectory_file import SUFFIX, write_trajectory
from daq.progress import Steps
from daq.session.bench import ArmOrder, OpenArm, opened
from daq.session.estimates import Estimate, estimate, require_room
from daq.session.motions import move_to, read_trajectory, refuse_undrivable, slowed
from daq.session.recorded_runs import Conducting, Recording, require_completed
from daq.session.session_error import NotMoved, SessionError
from daq.session.stages import (
    SLOW_SPEED,
    StageName,
    StageStatus,
    fingerprint,
    stages_to_do,
    status,
)
from daq.session.streaming import Watcher
from daq.session.warm_up import warm_up
from trajectories import Trajectory, plan


@dataclass(frozen=True)
class CommissionRequest:
    """What to walk through.

    Attributes:
        arm: which arm, where.
        folder: for the trajectory and the recordings; exists and is writable.
        trajectory: file of a motion; one is planned where None.
        duration, periods, evaluations, seed: of the plan.
        first, last: stages to begin and to end with; see :func:`daq.session.stages.stages_to_do`.
        slow_speed: of the slow run; at most a tenth.
        rounds: of the warm-up.
        note: the operator's.
        catalogue: where passes are kept; without one everything is gone through each time.
        confirm: asked before each stage that moves; False ends it there.
    """

    arm: ArmOrder
    folder: Path
    trajectory: Path | None = None
    duration: float = 12.0
    periods: int = 2
    evaluations: int = 6000
    seed: int = 0
    first: StageName | None = None
    last: StageName | None = None
    slow_speed: float = SLOW_SPEED
    rounds: int = 1
    note: str = ""
    catalogue: Catalogue | None = None
    confirm: Callable[[str], bool] = lambda question: True


@dataclass(frozen=True)
class Planned:
    """What commissioning would do, known before anything moves.

    Attributes:
        file: of the trajectory.
        sha256: of that file.
        states: where each stage stands, as far as the arm is known.
        estimates: of the stages that move and whose motion is known yet.
    """

    file: Path
    sha256: str
    trajectory: Trajectory
    states: tuple[StageStatus, ...]
    estimates: dict[StageName, Estimate]


@dataclass(frozen=True)
class StageDone:
    """A stage that was gone through; ``run`` is its number in the catalogue."""

    name: StageName
    words: str
    run: int | None
    capture: Path | None


def plan_commission(request: CommissionRequest, steps: Steps) -> Planned:
    """The dry run: plan or read the trajectory, judge it, say what everything takes. No frame is sent.

    Raises:
        PlanError, TrajectoryFileError, TrajectoryError: there is no motion that may be driven.
        SessionError: the slow run would not be slow, or there is no room for the recordings.
    """
    robot = request.arm.robot
    if not 0.0 < request.slow_speed <= SLOW_SPEED:
        raise SessionError(f"--slow-speed {request.slow_speed:g}; allowed: above 0, up to {SLOW_SPEED:g}")
    file = request.trajectory or _planned_file(request, steps)
    trajectory = read_trajectory(file, robot)
    refuse_undrivable(robot, trajectory, file)
    sha256 = sha256_of(file.read_text(encoding="utf-8"))
    start = np.asarray(trajectory.position[0])
    estimates = {
        "warm-up": estimate(robot, warm_up(robot, start, rounds=request.rounds).duration),
        "slow run": estimate(robot, trajectory.duration / request.slow_speed),
        "full run": estimate(robot, trajectory.duration),
    }
    total = Estimate(
        sum(part.seconds for part in estimates.values()), sum(part.size for part in estimates.values())
    )
    require_room(request.folder, total)
    states = status(request.catalogue, _known_identity(request), sha256)
    return Planned(file, sha256, trajectory, states, estimates)  # type: ignore[arg-type]


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
    with opened(request.arm, request.catalogue, steps) as arm:
        states = status(request.catalogue, arm.identity, planned.sha256)
        todo = stages_to_do(states, request.first, request.last)
        walk = _Walk(request, planned, arm, steps, watcher, conducting)
        return tuple(walk.through(name) for name in todo)


@dataclass(frozen=True)
class _Walk:
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
            return self._keep_still(name, f"{trajectory_words(self.planned.trajectory)}, {self.planned.file}")
        if name == "check":
            return self._keep_still(name, self._check())
        motion = self._motion(name)
        if motion is None:
            return self._keep_still(name, "the arm stands there already")
        if name not in ("approach", "return"):
            self._go_to_start()
        return self._drive(name, motion)

    def _motion(self, name: StageName) -> Trajectory | None:
        robot, trajectory = self.request.arm.robot, self.planned.trajectory
        start = np.asarray(trajectory.position[0])
        if name == "approach":
            return move_to(self.arm, start)
        if name == "return":
            return move_to(self.arm, np.array(robot.home))
        if name == "warm-up":
            return warm_up(robot, start, rounds=self.request.rounds)
        return slowed(trajectory, self.request.slow_speed) if name == "slow run" else trajectory

    def _go_to_start(self) -> None:
        """Where the arm was moved since its approach, it approaches again."""
        way = move_to(self.arm, np.asarray(self.planned.trajectory.position[0]))
        if way is not None:
            self._drive("approach", way)

    def _drive(self, name: StageName, motion: Trajectory) -> StageDone:
        wanted = estimate(self.request.arm.robot, motion.duration)
        if not self.request.confirm(
            f"Stage {name}: {trajectory_words(motion)}, {wanted.words()}. Move the arm?"
        ):
            raise NotMoved(f"stage {name} was not confirmed; what passed before it is kept")
        request = self.request
        recording = Recording(
            self.arm, request.arm, request.catalogue, self.watcher, self.conducting, request.note
        )
        path = _free(request.folder, name.replace(" ", "-"))
        kept, result = recording.record(
            "commission",
            f"{request.arm.robot.name}: {name}",
            motion,
            path,
            stage=name,
            facts=fingerprint(self.arm.identity, self.planned.sha256),
        )
        require_completed(result, path)
        return StageDone(name, f"{trajectory_words(motion)}", kept.number, path)

    def _check(self) -> str:
        """Machine, bus and drives; the drives have answered and agree with the description already."""
        found = examine(self.request.arm.robot)  # the bus is ours: the drives have answered on it
        failed = [check for check in found if check.status == "failed"]
        if failed:
            raise SessionError(
                f"stage check: {failed[0].name}: {failed[0].detail}; {failed[0].remedy}; see `armhil doctor`"
            )
        doubtful = [check.name for check in found if check.status != "ok"]
        serials = ", ".join("?" if s is None else str(s) for s in self.arm.identity.serials)
        rest = f"look at {', '.join(doubtful)}" if doubtful else "all is well"
        return f"drives {serials}; {rest}"

    def _keep_still(self, name: StageName, words: str) -> StageDone:
        """Keep a stage that moved nothing."""
        facts = {"channel": str(self.request.arm.channel), "found": words}
        facts |= fingerprint(self.arm.identity, self.planned.sha256)
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


def _planned_file(request: CommissionRequest, steps: Steps) -> Path:
    robot = request.arm.robot
    with steps.step("Plan exciting trajectory") as update:
        trajectory = plan(
            robot,
            cycle_time=robot.bus.cycle_time,
            duration=request.duration,
            seed=request.seed,
            evaluations=request.evaluations,
            periods=request.periods,
            progress=lambda share, score: update(share, f"score {score:.2f}" if score < 1e3 else ""),
        )
    file = request.folder / f"{robot.name}{SUFFIX}"
    write_trajectory(file, trajectory, robot)
    return file


def _known_identity(request: CommissionRequest) -> ArmIdentity | None:
    """The arm, if the catalogue knows one of this name and kind; its drives have not been asked."""
    if request.catalogue is None:
        return None
    wanted = identity_of_arm(request.arm.robot, simulated=request.arm.simulated)
    known = [
        arm
        for arm in arms.every(request.catalogue, name=wanted.name)
        if arm.simulated == wanted.simulated and arm.serials
    ]
    return replace(wanted, serials=known[0].serials) if len(known) == 1 else None


def _free(folder: Path, name: str) -> Path:
    """A file of that name that is not there yet: nothing is ever overwritten."""
    number = 1
    path = folder / f"{name}.mcap"
    while path.exists():
        number += 1
        path = folder / f"{name}-{number}.mcap"
    return path
