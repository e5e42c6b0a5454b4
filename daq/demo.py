"""``armhil demo``: the whole chain on simulated drives, from an exciting trajectory to a verdict."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from daq.catalogue.again import IDENTIFY
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import SIMULATED, identity_of_arm
from daq.catalogue.keep import Made, keep_identified
from daq.catalogue.kept_run import KeptRun, kept_run, trajectory_words
from daq.files.model_file import SUFFIX
from daq.identification.results import write_results
from daq.identification.run_facts import report_facts
from daq.importing.load import capture_recordings
from daq.progress import Steps
from daq.recording.capture import Capture
from daq.recording.reader import read_capture
from daq.session.exciting import plan_exciting
from daq.session.recorded_runs import Conducting, require_completed, unconducted
from daq.session.session_error import RunFailed, RunInterrupted
from daq.session.streaming import StreamOrder, stream_recorded
from daq.session.watching import StepBar, Watcher
from drivers import ArmSession, BusError, Channel
from drivers.simulated import PlantTruth, SimulatedArm
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
    if request.channel.interface == "virtual":
        raise BusError(f"{request.channel} lives inside one process; the simulated drives have their own")
    with steps.step("Start simulated drives"):
        arm = SimulatedArm(request.robot_source, request.channel, request.seed)
    with arm:
        with steps.step("Configure drives"):
            session = ArmSession(robot, request.channel)
            session.open()
        try:
            trajectory = plan_exciting(
                robot,
                steps,
                duration=request.duration,
                seed=request.seed,
                evaluations=request.evaluations,
                periods=request.periods,
                start=None if request.periods > 1 else session.actual_position(),
            )
            identity = identity_of_arm(robot, session.drives, simulated=True)
            with kept_run(
                request.catalogue,
                identity,
                "demo",
                trajectory=trajectory_words(trajectory),
                facts={
                    "channel": str(request.channel),
                    "seed": request.seed,
                    "folder": str(request.folder.absolute()),
                },
            ) as kept:
                path = _stream(request, session, trajectory, steps, kept)
        finally:
            session.close()
        plant = arm.truth()
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
        made = Made(robot, [capture.path], {"command": IDENTIFY}, model, report)
        keep_identified(request.catalogue, fitted, made, kept.number)
    return DemoResult(fitted, truth, capture, report, kept.number)


def true_base_parameters(base: BaseParameters, plant: PlantTruth) -> dict[str, float]:
    """The simulated arm's base parameters by name, SI: what the estimates are compared with."""
    drives = drive_parameters(
        base.model.robot, plant.per_drive("Ia"), plant.per_drive("Fv"), plant.per_drive("Fc")
    )
    values = base.regroup({**plant.parameters, **drives})
    return dict(zip(base.names, values.tolist(), strict=True))


def _stream(
    request: DemoRequest, session: ArmSession, trajectory: Trajectory, steps: Steps, kept: KeptRun
) -> Path:
    """Stream and record; returns the capture's path."""
    path = request.folder / "capture.mcap"
    run = {"kind": SIMULATED, "seed": str(request.seed), "periods": str(request.periods)}
    order = StreamOrder(f"{request.robot.name}: demonstration", trajectory, path, run)
    with request.conducting() as conduct:
        if request.watcher is not None:
            result = stream_recorded(session, order, request.watcher, conduct)
        else:
            with steps.step("Stream and record") as update:
                result = stream_recorded(session, order, StepBar(update), conduct)
    kept.streamed(result, path)
    require_completed(result, path)
    return path
