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
from daq.identification.run_facts import outcome_facts, report_facts, run_facts
from daq.importing.load import capture_recordings
from daq.progress import Steps
from daq.recording.capture import Capture
from daq.recording.listener import listening
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from drivers import ArmSession, BusError, Channel, Samples
from drivers.simulated import PlantTruth, SimulatedArm
from ident import BaseParameters, Fitted, drive_parameters, identify
from robots import Robot
from trajectories import Trajectory, plan


class RunInterrupted(Exception):
    """The run was stopped on request; the arm is at rest and the capture so far is readable."""


class RunFailed(Exception):
    """The arm ended the run itself; the capture so far is readable."""


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
            trajectory = _plan(request, session, steps)
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
    with steps.step("Identify") as update:
        fitted = identify(robot, tuple(capture_recordings(capture)), lambda step, share: update(share, step))
    truth = true_base_parameters(fitted.base, plant)
    (request.folder / "truth.json").write_text(json.dumps(plant.as_dict(), indent=2) + "\n", encoding="utf-8")
    report = write_results(
        request.folder,
        robot,
        fitted,
        [capture.path],
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


def _plan(request: DemoRequest, session: ArmSession, steps: Steps) -> Trajectory:
    with steps.step("Plan exciting trajectory") as update:
        return plan(
            request.robot,
            cycle_time=request.robot.bus.cycle_time,
            duration=request.duration,
            seed=request.seed,
            start=None if request.periods > 1 else session.actual_position(),
            evaluations=request.evaluations,
            periods=request.periods,
            progress=lambda share, score: update(share, f"score {score:.2f}"),
        )


def _stream(
    request: DemoRequest, session: ArmSession, trajectory: Trajectory, steps: Steps, kept: KeptRun
) -> Path:
    """Stream and record; returns the capture's path."""
    path = request.folder / "capture.mcap"
    total = trajectory.time.shape[0]
    run = {
        "channel": str(request.channel),
        "kind": SIMULATED,
        "seed": str(request.seed),
        "periods": str(request.periods),
    }
    facts = run_facts(request.robot, run, trajectory, session.drives)
    with (
        steps.step("Stream and record") as update,
        listening(request.channel, request.robot.bus.bitrate) as listener,
        Recorder(path, request.robot, facts, listener=listener) as recorder,
    ):

        def keep(samples: Samples) -> None:
            recorder.write(samples)
            if len(samples.cycle):
                cycle = int(samples.cycle[-1])
                missing = int((~samples.complete).sum())
                update(cycle / total, f"cycle {cycle}, {missing} late TPDOs" if missing else f"cycle {cycle}")

        result = session.stream(trajectory.position, keep)
        recorder.finish(outcome_facts(result))
    kept.streamed(result, path)
    if result.outcome == "stopped":
        raise RunInterrupted(
            f"stopped ({result.reason}): axes at rest and disabled, {result.cycles} cycles kept in {path}"
        )
    if result.outcome != "completed":
        raise RunFailed(f"the run ended early: {result.reason}; {result.cycles} cycles kept in {path}")
    return path
