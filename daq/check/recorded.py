"""The first half of a check: preflight, the accepted trajectory, the stream, the recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from daq.catalogue import arms, baselines, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.descriptions import Description
from daq.catalogue.identity import description_of, sha256_of
from daq.catalogue.values import Arm, ArmMismatch, Baseline, CatalogueError
from daq.check.commissioned import require_commissioned
from daq.check.errors import CheckError
from daq.check.request import CheckRequest
from daq.check.simulated_night import with_own_noise
from daq.recording.reader import read_capture
from daq.session.bench import OpenArm, opened
from daq.session.estimates import estimate, require_room
from daq.session.exciting import kept_in, plan_exciting
from daq.session.motions import move_to, read_trajectory, refuse_undrivable
from daq.session.recorded_runs import Conducting, Recording, require_completed
from daq.session.stages import TRAJECTORY_FILE
from daq.session.streaming import Watcher
from daq.text.progress import Steps
from robots import Robot
from trajectories import Trajectory

TRAJECTORY, TRAJECTORY_SHA256 = TRAJECTORY_FILE, "trajectory_sha256"
CELL, CELL_SHA256 = "cell_file", "cell_sha256"
"""Facts of a run in the catalogue by which the next check finds its motion, its temperature and its cell."""


@dataclass(frozen=True)
class Recorded:
    """A recorded check on its way to be judged.

    Attributes:
        arm: in the catalogue.
        run: its number.
        capture: the recording.
        celsius: (n,) temperature of the joints, or None.
        warnings: what was noticed so far.
        baseline: number of the one that counted when the check began; None where there was none. Its motion
            was driven, so it is compared with that one, whichever is accepted meanwhile.
    """

    arm: Arm
    run: int
    capture: Path
    celsius: tuple[float, ...] | None
    warnings: tuple[str, ...] = ()
    baseline: int | None = None

    def compared_with(self, catalogue: Catalogue) -> Baseline | None:
        """The baseline as it is now; None where it was taken back meanwhile, too."""
        if self.baseline is None:
            return None
        found = baselines.get(catalogue, self.baseline)
        return None if found.state == "rolled_back" else found


@dataclass(frozen=True)
class Motion:
    """What is driven. ``sha256`` is that of the file: nights are compared on one and the same motion."""

    trajectory: Trajectory
    file: Path
    sha256: str


def record_check(request: CheckRequest, steps: Steps, watcher: Watcher, conducting: Conducting) -> Recorded:
    """Take the arm, drive its trajectory once, record it.

    Raises:
        BusError, DriveError, ArmMismatch, LeaseHeld: the arm cannot be had, or is another one.
        CheckError, PlanError, TrajectoryFileError, SessionError: there is no motion that may be driven
            in this cell.
        CaptureError: the recording cannot be written.
        RunInterrupted, RunFailed: it did not come to its end.
    """
    catalogue, robot = request.catalogue, request.arm.robot
    runs.settle_abandoned(catalogue)
    request = replace(request, arm=with_own_noise(request.arm, catalogue))
    with opened(request.arm, catalogue, steps, "drive", request.cell) as arm:
        known = arms.register(catalogue, arm.identity)
        baseline = baselines.current(catalogue, known.id)
        if baseline is not None:
            require_own_baseline(catalogue, known, baseline, description_of(robot))
        with steps.step("Preflight"):
            motion, warnings = _motion(request, arm, known, baseline)
            if motion is not None:
                refuse_undrivable(robot, motion.trajectory, motion.file, request.cell)
            if not request.arm.simulated:
                sha256 = None if motion is None else motion.sha256
                require_commissioned(catalogue, known, arm.identity, sha256, request.cell.sha256)
            warnings = (*warnings, *_other_cell(request, baseline))
        if motion is None:
            motion = planned_motion(request, arm, steps)
            refuse_undrivable(robot, motion.trajectory, motion.file, request.cell)
        require_room(request.folder, estimate(robot, motion.trajectory.duration))
        recorded = _stream(request, arm, known, motion, warnings, watcher, conducting, steps)
        return replace(recorded, baseline=None if baseline is None else baseline.id)


def require_own_baseline(
    catalogue: Catalogue, arm: Arm, baseline: Baseline, description: Description
) -> None:
    """Is the baseline of this arm, under the description that is used now?

    Raises:
        ArmMismatch: one line that names both sides.
    """
    try:
        arms.require_same_description(
            catalogue,
            arm,
            baseline.description_sha256,
            description,
            f"baseline of run {baseline.run_id}",
        )
    except ArmMismatch as mismatch:
        raise ArmMismatch(
            f"{mismatch}; put the description back, or `armhil baseline rollback {arm.label}`, commission the"
            " arm with the new one and accept a baseline of it"
        ) from None


def _motion(
    request: CheckRequest, arm: OpenArm, known: Arm, baseline: Baseline | None
) -> tuple[Motion | None, tuple[str, ...]]:
    """The motion that was asked for, or the accepted one; None where one has to be planned."""
    robot = arm.session.robot
    accepted = None if baseline is None else accepted_file(request.catalogue, baseline)
    if request.trajectory is not None:
        motion = _read(request.trajectory, robot)
        if accepted is not None and accepted[1] != motion.sha256:
            return motion, (
                f"{request.trajectory} is not the accepted trajectory: arm and motion differ together",
            )
        return motion, ()
    if accepted is None:
        return None, ()
    file, sha256 = accepted
    whose = f"arm {known.label}'s baseline"
    if not file.exists():
        raise CheckError(
            f"{file}: the trajectory of {whose} is gone; give --trajectory or accept another baseline"
        )
    motion = _read(file, robot)
    if motion.sha256 != sha256:
        raise CheckError(f"{file}: is not the trajectory any more that {whose} was accepted with")
    return motion, ()


def accepted_file(catalogue: Catalogue, baseline: Baseline) -> tuple[Path, str] | None:
    """File and checksum of the trajectory of a baseline; None where neither check nor full run made it."""
    try:
        facts = runs.get(catalogue, baseline.run_id).facts
    except CatalogueError:
        return None
    if TRAJECTORY not in facts:
        return None
    return Path(str(facts[TRAJECTORY])), str(facts[TRAJECTORY_SHA256])


def _other_cell(request: CheckRequest, baseline: Baseline | None) -> tuple[str, ...]:
    """A warning where tonight's surroundings are not those that the baseline was recorded in."""
    if baseline is None:
        return ()
    try:
        facts = runs.get(request.catalogue, baseline.run_id).facts
    except CatalogueError:
        return ()
    then, now = str(facts.get(CELL_SHA256, "")), request.cell.sha256
    if TRAJECTORY not in facts or then == now:
        return ()
    was = str(facts.get(CELL, "a cell file")) if then else "no cell"
    if not now:
        return (
            f"the baseline was recorded with {was}, this check has no --cell: obstacles are not looked at",
        )
    return (f"{request.cell.file} is not the cell that the baseline was recorded in ({was})",)


def _read(file: Path, robot: Robot) -> Motion:
    trajectory = read_trajectory(file, robot)
    return Motion(trajectory, file, sha256_of(file.read_text(encoding="utf-8")))


def planned_motion(request: CheckRequest, arm: OpenArm, steps: Steps) -> Motion:
    """A new exciting motion, clear of the cell, in a file of the check's folder."""
    robot = arm.session.robot
    trajectory = plan_exciting(
        robot,
        steps,
        duration=request.duration,
        seed=request.arm.seed,
        start=np.array(robot.home),
        conditions=request.cell.for_plans,
        evaluations=request.evaluations,
    )
    return _read(kept_in(request.folder.absolute(), trajectory, robot), robot)


def _stream(
    request: CheckRequest,
    arm: OpenArm,
    known: Arm,
    motion: Motion,
    warnings: tuple[str, ...],
    watcher: Watcher,
    conducting: Conducting,
    steps: Steps,
) -> Recorded:
    recording = Recording(arm, request.arm, request.catalogue, watcher, conducting, celsius=request.celsius)
    way = move_to(arm, np.asarray(motion.trajectory.position[0]), request.cell)
    if way is not None:
        with steps.step("Approach"):
            path = request.folder / "approach.mcap"
            facts = _cell_facts(request)
            _, result = recording.record("check", "Approach", way, path, stage="approach", facts=facts)
            require_completed(result, path)
    facts = {TRAJECTORY: str(motion.file.absolute()), TRAJECTORY_SHA256: motion.sha256}
    facts |= _cell_facts(request)
    path = request.folder / "capture.mcap"
    with steps.step("Stream and record"):
        kept, result = recording.record("check", "Check", motion.trajectory, path, facts=facts)
    require_completed(result, path)
    assert kept.number is not None
    if result.missed_cycles:
        warnings = (*warnings, f"{result.missed_cycles} SYNC cycles were missed")
    warnings = (*warnings, *result.doubtful)
    return Recorded(known, kept.number, path, _celsius(request, path), warnings)


def _cell_facts(request: CheckRequest) -> dict[str, str]:
    """The cell of a run; nothing where there is none."""
    cell = request.cell
    return {} if cell.file is None else {CELL: str(cell.file.absolute()), CELL_SHA256: cell.sha256}


def _celsius(request: CheckRequest, path: Path) -> tuple[float, ...] | None:
    """(n,) mean of what each joint's drive reported during the run, else what was given of the hall."""
    reported = reported_celsius(path, request.arm.robot)
    if reported is None and request.celsius is not None:
        return (request.celsius,) * len(request.arm.robot.joint)
    return reported


def reported_celsius(path: Path, robot: Robot) -> tuple[float, ...] | None:
    """(n,) mean of what each joint's drive reported during a run; None where one did not.

    Raises:
        CaptureError: the recording cannot be read.
    """
    readings: dict[str, list[float]] = {joint.name: [] for joint in robot.joint}
    for reading in read_capture(path).temperatures:
        if reading.joint in readings:
            readings[reading.joint].append(reading.celsius)
    if not all(readings.values()):
        return None
    return tuple(float(np.mean(found)) for found in readings.values())
