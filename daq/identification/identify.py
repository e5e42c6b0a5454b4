"""``armhil identify``: recordings in, a model with its verdict, report and model file out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from daq.files.run_folder import make_run_folder
from daq.identification.carried import Carried, require_known, with_carried
from daq.identification.identify_options import chosen_settings
from daq.identification.urdf_file import check_urdf_path, write_urdf
from daq.importing.guess_log import GuessRequest, guessed_arm
from daq.importing.load import load_recording
from daq.importing.loaded import LoadedRecordings
from daq.text.progress import Steps, Update
from ident import Fitted, Options, Recording
from ident import identify as identify_recordings
from ident.identification.found_effects import FoundModel
from ident.results import Method
from robots import Robot

if TYPE_CHECKING:
    from daq.recording.capture import Capture

# What only captures, found effects or written results need (the bus, the compiler, the database, plots) is
# imported where it is used: a log alone is read in half the time and memory.


@dataclass(frozen=True)
class IdentifyRequest:
    """What to identify from what.

    Attributes:
        paths: captures or logs.
        robot: name or path, or the arm itself; the first capture's own description where None.
        columns: a column map for logs; the robot's where None.
        cutoff_hz: low-pass for the positions; ``"auto"`` takes the proposal, the settings' where None.
        rate_hz: rows per second after decimation; the settings' where None.
        out: folder for report, result and model file; nothing is written where None.
        method: which estimators, see :class:`ident.Options`.
        covariance: of the estimates, by name; the settings' where None.
        friction: ``symmetric`` or ``asymmetric``; the settings' where None.
        validate: captures or logs that are predicted and not fitted to.
        essential: look for the essential parameters too.
        urdf: file for the arm's URDF with the identified inertias; not written where None.
        guess: what a log is to be taken for by its URDF; None where its arm is described.
        model: a model file whose found effects are part of the model, or what it held; the usual model
            where None.
        carried: which recordings, of those to fit or to predict, were made with a known body on the arm.
    """

    paths: tuple[Path, ...]
    robot: str | Robot | None = None
    columns: Path | None = None
    cutoff_hz: float | Literal["auto"] | None = None
    rate_hz: float | None = None
    out: Path | None = None
    method: Method = "auto"
    covariance: str | None = None
    friction: str | None = None
    validate: tuple[Path, ...] = ()
    essential: bool = False
    urdf: Path | None = None
    model: Path | FoundModel | None = None
    guess: GuessRequest | None = None
    carried: tuple[Carried, ...] = ()


@dataclass(frozen=True)
class IdentifyResult:
    """What came out; ``report`` and ``urdf`` are None where not asked for; ``guessed`` is of a log."""

    fitted: Fitted
    report: Path | None
    urdf: Path | None = None
    guessed: tuple[str, ...] = ()

    @property
    def model(self) -> Path | None:
        """The model file beside the report."""
        from daq.files.model_file import SUFFIX

        return None if self.report is None else self.report.parent / f"{self.fitted.result.robot}{SUFFIX}"


def run_identify(request: IdentifyRequest, steps: Steps) -> IdentifyResult:
    """Read, identify, write.

    Raises:
        CaptureError, RobotFileError, ModelFileError, IdentificationError, OutputError: one line each.
        ArmMismatch: the recordings are of two arms.
    """
    require_known(request.carried, (*request.paths, *request.validate))
    folder = None if request.out is None else make_run_folder(request.out, "identify")
    with _arm_of(request, steps) as (robot, first, columns, guessed):
        if request.urdf is not None:
            check_urdf_path(request.urdf, robot)
        found = _found_model(request.model, robot)
        with steps.step("Read recordings") as update:
            read = _loaded((*request.paths, *request.validate), robot, columns, first, update)
        loaded, held_out = read[: len(request.paths)], read[len(request.paths) :]
        loaded = with_carried(loaded, request.carried, robot)
        held_out = with_carried(held_out, request.carried, robot)
        doubts = _doubts_of_arm(loaded, held_out, robot)
        recordings = _recordings(loaded)
        settings = chosen_settings(
            loaded[0].settings,
            recordings[0],
            cutoff_hz=None if request.cutoff_hz == "auto" else request.cutoff_hz,
            rate_hz=request.rate_hz,
            covariance=request.covariance,
            friction=request.friction,
        )
        robot = robot.model_copy(update={"identification": settings})
        options = Options(
            method=request.method,
            validation=_recordings(held_out),
            propose_cutoff=request.cutoff_hz == "auto",
            essential=request.essential,
            found=found,
        )
        with steps.step("Identify") as update:
            fitted = identify_recordings(robot, recordings, lambda step, share: update(share, step), options)
        if found is not None and not found.found:
            doubts = [*doubts, f"{found.source} has no found effects; this is the usual model"]
        sentences = [*doubts, *(text for part in (*loaded, *held_out) for text in part.warnings)]
        fitted = _with_warnings(fitted, sentences)
        report = None if folder is None else _write(folder, fitted.base.model.robot, loaded, fitted)
        if request.urdf is not None:
            write_urdf(request.urdf, fitted, [part.path for part in loaded])
    return IdentifyResult(fitted, report, request.urdf, guessed)


@contextmanager
def _arm_of(
    request: IdentifyRequest, steps: Steps
) -> Iterator[tuple[Robot, Capture | None, Path | None, tuple[str, ...]]]:
    """The arm, the capture that described it, the column map, and what was guessed."""
    if request.guess is None:
        from daq.recording.described_arm import described

        with described(request.robot, request.paths[0]) as (robot, first):
            yield robot, first, request.columns, ()
        return
    with ExitStack() as stack:
        with steps.step("Guess what the columns mean"):
            guessed = stack.enter_context(guessed_arm(request.paths[0], request.guess))
        yield guessed.robot, None, request.columns, tuple(guessed.words)


def _found_model(source: Path | FoundModel | None, robot: Robot) -> FoundModel | None:
    if not isinstance(source, Path):
        return source
    from daq.files.found_model import read_found_model

    return read_found_model(source, robot)


def _doubts_of_arm(
    loaded: list[LoadedRecordings], held_out: list[LoadedRecordings], robot: Robot
) -> list[str]:
    """What is to be said where captures are of another arm; logs do not say of which they are."""
    if all(part.capture is None for part in (*loaded, *held_out)):
        return []
    from daq.identification.same_arm import doubts_of_arm, refuse_two_arms

    refuse_two_arms(loaded)
    return doubts_of_arm(loaded, held_out, robot)


def _recordings(loaded: list[LoadedRecordings]) -> tuple[Recording, ...]:
    return tuple(recording for part in loaded for recording in part.recordings)


def _loaded(
    paths: tuple[Path, ...], robot: Robot, columns: Path | None, first: Capture | None, update: Update
) -> list[LoadedRecordings]:
    """The recordings of each path."""

    def done(number: int, share: float) -> None:
        update((number + share) / len(paths), "")

    return [_load(path, robot, columns, first, partial(done, k)) for k, path in enumerate(paths)]


def _load(
    path: Path, robot: Robot, columns: Path | None, first: Capture | None, done: Callable[[float], None]
) -> LoadedRecordings:
    """The recordings of a path; of the capture that described the arm without reading it again."""
    if first is not None and path == first.path:
        from daq.importing.captures import loaded_capture

        return loaded_capture(first, robot)
    return load_recording(path, robot, columns, done)


def _with_warnings(fitted: Fitted, warnings: list[str]) -> Fitted:
    """What is missing in the recordings stands before what the estimates say, wherever results are shown."""
    result = replace(fitted.result, warnings=(*warnings, *fitted.result.warnings))
    return replace(fitted, result=result)


def _write(folder: Path, robot: Robot, loaded: list[LoadedRecordings], fitted: Fitted) -> Path:
    from daq.identification.results import write_results
    from daq.recording.run_facts import report_facts

    captures = [part.path for part in loaded]
    first = loaded[0].capture
    facts = {"Recordings": ", ".join(map(str, captures))} if first is None else report_facts(first)
    return write_results(
        folder,
        robot,
        fitted,
        captures,
        _recordings(loaded),
        title=f"{robot.name}: identification",
        facts=facts,
    )
