"""``armhil demo``: the whole chain on simulated drives, from an exciting trajectory to a verdict."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from daq.catalogue.database import Catalogue
from daq.catalogue.kept_run import KeptRun
from daq.files.model_file import SUFFIX
from daq.identification.results import write_results
from daq.importing.captures import capture_recordings
from daq.keeping.again import IDENTIFY
from daq.keeping.keep import Provenance, keep_identified
from daq.recording.capture import Capture
from daq.recording.reader import read_capture
from daq.recording.run_facts import report_facts
from daq.session.bench import ArmOrder, OpenArm, opened
from daq.session.exciting import plan_exciting
from daq.session.recorded_runs import Conducting, Recording, require_completed, unconducted
from daq.session.session_error import RunFailed, RunInterrupted
from daq.session.watching import StepBar, Watcher
from daq.text.progress import Steps
from drivers import Channel, StreamResult
from drivers.simulated import PlantTruth
from ident import BaseParameters, Fitted, drive_parameters, identify
from robots import Robot
from trajectories import Trajectory

__all__ = ["DemoRequest", "DemoResult", "RunFailed", "RunInterrupted", "run_demo", "true_base_parameters"]


@dataclass(frozen=True)
class DemoRequest:
    """What to run.

    Attributes:
        robot: the arm.
        robot_source: its name or path, for the process of the simulated drives.
        channel: the bus.
        seed: of the simulated arm, its noise, and the search for a trajectory.
        folder: where results go; exists and is writable.
        duration: of one period of the exciting trajectory, s.
        periods: how often it is repeated.
        evaluations: trials of the trajectory search.
        catalogue: where the run and its model are kept; nowhere where None.
        watcher: sees the stream; a progress bar where None.
        conducting: gives the conduct of the stream.
        any_group: take the next multicast group where the channel's is occupied.
        scenario: what the arm hides; nothing where None.
    """

    robot: Robot
    robot_source: str
    channel: Channel
    seed: int
    folder: Path
    duration: float
    periods: int
    evaluations: int
    catalogue: Catalogue | None = None
    watcher: Watcher | None = None
    conducting: Conducting = unconducted
    any_group: bool = False
    scenario: Path | None = None


@dataclass(frozen=True)
class DemoResult:
    """What came out; ``run`` is its number in the catalogue."""

    fitted: Fitted
    truth: dict[str, float]
    capture: Capture
    report: Path
    run: int | None = None


def run_demo(request: DemoRequest, steps: Steps) -> DemoResult:
    """Simulate an arm, plan, stream, record, identify, test, compare with the truth, report.

    Raises:
        BusError, DriveError: the bus is occupied, or a drive refuses.
        PlanError: no trajectory meets the request.
        CaptureError: the recording cannot be written.
        IdentificationError: the recording cannot be identified.
        CatalogueError: the catalogue cannot be written.
        RunInterrupted: stopped on request.
        RunFailed: the arm ended the run itself.
    """
    robot = request.robot
    order = ArmOrder(
        robot,
        request.robot_source,
        request.channel,
        simulated=True,
        seed=request.seed,
        any_group=request.any_group,
        scenario=request.scenario,
    )
    with opened(order, request.catalogue, steps, "demonstrate") as arm:
        assert arm.drives is not None
        trajectory = plan_exciting(
            robot,
            steps,
            duration=request.duration,
            seed=request.seed,
            evaluations=request.evaluations,
            periods=request.periods,
            start=None if request.periods > 1 else arm.session.actual_position(),
        )
        number, path = _stream(request, order, arm, trajectory, steps)
        plant = arm.drives.truth()
    capture = read_capture(path)
    recordings = tuple(capture_recordings(capture))
    with steps.step("Identify") as update:
        fitted = identify(robot, recordings, lambda step, share: update(share, step))
    truth = true_base_parameters(fitted.base, plant)
    (request.folder / "truth.json").write_text(json.dumps(plant.as_dict(), indent=2) + "\n", encoding="utf-8")
    report = write_results(
        request.folder,
        robot,
        fitted,
        [capture.path],
        recordings,
        title=f"{robot.name}: demonstration on simulated drives",
        facts=report_facts(capture),
        truth=truth,
    )
    if request.catalogue is not None:
        model = request.folder / f"{robot.name}{SUFFIX}"
        # Again with nothing but the recording: it describes the arm as this run knows it.
        provenance = Provenance(robot, [capture.path], {"command": IDENTIFY}, model, report)
        keep_identified(request.catalogue, fitted, provenance, number)
    return DemoResult(fitted, truth, capture, report, number)


def true_base_parameters(base: BaseParameters, plant: PlantTruth) -> dict[str, float]:
    """The simulated arm's base parameters by name, SI: what the estimates are compared with."""
    drives = drive_parameters(
        base.model.robot, plant.per_drive("Ia"), plant.per_drive("Fv"), plant.per_drive("Fc")
    )
    values = base.regroup({**plant.parameters, **drives})
    return dict(zip(base.names, values.tolist(), strict=True))


def _stream(
    request: DemoRequest, order: ArmOrder, arm: OpenArm, trajectory: Trajectory, steps: Steps
) -> tuple[int | None, Path]:
    """Stream and record; the run's number in the catalogue, and the capture's path."""
    path = request.folder / "capture.mcap"
    facts = {"periods": str(request.periods), "folder": str(request.folder.absolute())}
    title = f"{request.robot.name}: demonstration"

    def record(watcher: Watcher) -> tuple[KeptRun, StreamResult]:
        recording = Recording(arm, order, request.catalogue, watcher, request.conducting)
        return recording.record("demo", title, trajectory, path, facts=facts)

    if request.watcher is not None:
        kept, result = record(request.watcher)
    else:
        with steps.step("Stream and record") as update:
            kept, result = record(StepBar(update))
    require_completed(result, path)
    return kept.number, path
