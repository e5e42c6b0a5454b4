"""``armhil identify``: recordings in, a model with its verdict, report and model file out."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import robots
from daq.capture import Capture, CaptureError
from daq.importing import CAPTURE_SUFFIX, LoadedRecordings, load_recording
from daq.progress import Steps
from daq.reader import read_capture
from daq.results import write_results
from daq.run_facts import report_facts
from daq.run_folder import make_run_folder
from ident import Fitted, IdentificationError, Recording
from ident import identify as identify_recordings
from robots import Identification, Robot


@dataclass(frozen=True)
class IdentifyRequest:
    """What to identify from what.

    Attributes:
        paths: captures or logs.
        robot: name or path; the first capture's own description where None.
        columns: a column map for logs; the robot's where None.
        cutoff_hz: low-pass for the positions; the settings' where None.
        rate_hz: rows per second after decimation; the settings' where None.
        out: folder for report, result and model file; nothing is written where None.
    """

    paths: tuple[Path, ...]
    robot: str | None = None
    columns: Path | None = None
    cutoff_hz: float | None = None
    rate_hz: float | None = None
    out: Path | None = None


@dataclass(frozen=True)
class IdentifyResult:
    """What came out; ``report`` is None where no folder was asked for."""

    fitted: Fitted
    report: Path | None


def run_identify(request: IdentifyRequest, steps: Steps) -> IdentifyResult:
    """Read, identify, write.

    Raises:
        CaptureError, RobotFileError, IdentificationError, OutputError: one line each.
    """
    folder = None if request.out is None else make_run_folder(request.out, "identify")
    with _described(request) as robot:
        with steps.step("Read recordings"):
            loaded = [load_recording(path, robot, request.columns) for path in request.paths]
        recordings = tuple(recording for part in loaded for recording in part.recordings)
        settings = _settings(loaded[0].settings, recordings[0], request)
        robot = robot.model_copy(update={"identification": settings})
        with steps.step("Identify") as update:
            fitted = identify_recordings(robot, recordings, lambda step, share: update(share, step))
        fitted = _with_warnings(fitted, [sentence for part in loaded for sentence in part.warnings])
        report = None if folder is None else _write(folder, robot, loaded, fitted)
    return IdentifyResult(fitted, report)


def _with_warnings(fitted: Fitted, warnings: list[str]) -> Fitted:
    """What is missing in the recordings stands before what the estimates say, wherever results are shown."""
    result = replace(fitted.result, warnings=(*warnings, *fitted.result.warnings))
    return replace(fitted, result=result)


@contextmanager
def _described(request: IdentifyRequest) -> Iterator[Robot]:
    """The arm that was asked for, or the one that the first capture describes."""
    if request.robot is not None:
        yield robots.load(request.robot)
        return
    first = request.paths[0]
    if first.suffix.lower() != CAPTURE_SUFFIX:
        raise CaptureError(f"{first}: is no capture, so it does not say of which arm it is; give --robot")
    capture = read_capture(first)
    with TemporaryDirectory(prefix="armhil-") as folder:
        yield _robot_of(capture, Path(folder))


def _robot_of(capture: Capture, folder: Path) -> Robot:
    """The arm as its capture describes it; its files are unpacked into a folder."""
    (folder / "robot.toml").write_text(capture.robot_text, encoding="utf-8")
    urdf = (folder / str(tomllib.loads(capture.robot_text)["urdf"])).resolve()
    if not urdf.is_relative_to(folder.resolve()):
        raise CaptureError(f"{capture.path}: its description puts the URDF outside its folder; give --robot")
    urdf.parent.mkdir(parents=True, exist_ok=True)
    urdf.write_text(capture.urdf_text, encoding="utf-8")
    return robots.load(folder)


def _settings(settings: Identification, recording: Recording, request: IdentifyRequest) -> Identification:
    changes: dict[str, float | int] = {}
    if request.cutoff_hz is not None:
        changes["cutoff_hz"] = request.cutoff_hz
    if request.rate_hz is not None:
        decimation = round(1.0 / (recording.sample_time * request.rate_hz))
        if decimation < 1:
            raise IdentificationError(
                f"--rate {request.rate_hz:g} Hz; allowed: up to {1.0 / recording.sample_time:g} Hz,"
                f" the sampling rate of {recording.name}"
            )
        changes["decimation"] = decimation
    return settings.model_copy(update=changes)


def _write(folder: Path, robot: Robot, loaded: list[LoadedRecordings], fitted: Fitted) -> Path:
    captures = [part.path for part in loaded]
    first = loaded[0].capture
    facts = {"Recordings": ", ".join(map(str, captures))} if first is None else report_facts(first)
    return write_results(folder, robot, fitted, captures, title=f"{robot.name}: identification", facts=facts)
