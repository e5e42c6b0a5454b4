"""``armhil diagnose``: find what the model lacks, name it, add it, show the gap shrink."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from daq.diagnosis.apart import PlanSettings, TellingApart
from daq.diagnosis.blind_spots import blind_spots
from daq.diagnosis.diagnose_result import DiagnoseRequest, DiagnoseResult
from daq.diagnosis.diagnosed_model import write_diagnosed_model
from daq.diagnosis.diagnosis_json import diagnosis_json, trajectory_names
from daq.diagnosis.diagnosis_page import DiagnosisContent, write_diagnosis_page
from daq.diagnosis.more import More, more_of
from daq.diagnosis.telling_apart import tell_apart
from daq.diagnosis.term_words import term_words
from daq.files.accepted_model import prior_from
from daq.files.cell_file import CellFile, read_cell
from daq.files.found_model import read_found_model
from daq.files.model_file import read_model
from daq.files.run_folder import make_run_folder
from daq.identification.carried import require_known, with_carried
from daq.importing.guess_log import guessed_arm
from daq.importing.load import load_recording
from daq.importing.loaded import LoadedRecordings
from daq.recording.described_arm import described
from daq.recording.trajectory_file import write_trajectory
from daq.text.progress import Steps
from ident import BaseParameters, IdentificationError, Recording, RegressorModel, base_parameters
from ident.discrepancy import Diagnosis, Prior, Question, described_prior
from ident.discrepancy.before_after import Series, before_and_after
from ident.discrepancy.by_evidence import EvidenceAnswer, diagnose_with_evidence
from ident.discrepancy.by_evidence.report.as_json import answer_json
from ident.discrepancy.settings import searching
from ident.discrepancy.unknown_feed_forward import with_feed_forward
from ident.discrepancy.verdict import beside_gate
from ident.effects.entry import found_words
from ident.effects.vocabulary import VOCABULARY
from ident.identification.found_effects import extended_model, found_entries
from ident.identification.loads import Unknown, unknown_of
from robots import Robot
from trajectories import Conditions

FROM_DESCRIPTION = "cad"
"""What ``--prior`` is given to take the description's own figures."""


def run_diagnose(request: DiagnoseRequest, steps: Steps) -> DiagnoseResult:
    """Read, search, write.

    Raises:
        CaptureError, RobotFileError, ModelFileError, IdentificationError, OutputError: one line each.
    """
    _require_validation(request)
    require_known(request.carried, (*request.fit, *request.validation))
    conditions = conditions_of(request.cell)
    folder = None if request.out is None else make_run_folder(request.out, "diagnose")
    with _arm_of(request) as (robot, guessed):
        question, uncut, unknown = _asked(robot, request, steps)
        robot = question.robot
        with steps.step("Search for the missing effect") as update:
            diagnosis, answer = diagnose_with_evidence(question, lambda step, share: update(share, step))
        with steps.step("Check the model without and with it"):
            recordings, _ = with_feed_forward(robot, (*uncut, *question.validation))
            whole, held = recordings[: len(uncut)], recordings[len(uncut) :]
            series = before_and_after(diagnosis, whole, held, robot.identification)
            diagnosis = beside_gate(diagnosis, series.checks[-1].gate)
        more = more_of(diagnosis, question, steps, power=request.power)
        result = _result(robot, request, diagnosis, answer, series, (), folder, more)
        if folder is not None:
            # Before a motion is planned: that takes minutes, and may fail.
            _write(folder, request, result)
            apart = _apart(robot, request, diagnosis, conditions, steps)
            if apart:
                result = _result(robot, request, diagnosis, answer, series, apart, folder, more)
                _write(folder, request, result)
    return replace(result, guessed=guessed, carried=unknown.sentences())


@contextmanager
def _arm_of(request: DiagnoseRequest) -> Iterator[tuple[Robot, tuple[str, ...]]]:
    """The arm, and what was guessed of the log."""
    if request.guess is None:
        with described(request.robot, request.fit[0]) as (robot, _):
            yield robot, ()
        return
    with guessed_arm(request.fit[0], request.guess) as guessed:
        yield guessed.robot, tuple(guessed.words)


def _asked(
    robot: Robot, request: DiagnoseRequest, steps: Steps
) -> tuple[Question, tuple[Recording, ...], Unknown]:
    """The question of a request, its recordings to fit, uncut, and what was not known of bodies."""
    with steps.step("Read recordings"):
        loaded = [load_recording(path, robot, request.columns) for path in request.fit]
        held = [load_recording(path, robot, request.columns) for path in request.validation]
    loaded, held = (with_carried(part, request.carried, robot) for part in (loaded, held))
    robot = robot.model_copy(update={"identification": loaded[0].settings})
    fit, validation = _recordings(loaded, held, request.split_half)
    model = _examined(robot, request, fit[0])
    uncut = tuple(recording for part in loaded for recording in part.recordings)
    unknown = Unknown() if not request.carried else unknown_of(base_parameters(RegressorModel.of(robot)), fit)
    fit, validation, uncut = map(unknown.complete, (fit, validation, uncut))
    return Question(robot, fit, validation, VOCABULARY, prior_of(request.prior), model), uncut, unknown


def _result(
    robot: Robot,
    request: DiagnoseRequest,
    diagnosis: Diagnosis,
    answer: EvidenceAnswer,
    series: Series,
    apart: tuple[TellingApart, ...],
    folder: Path | None,
    more: More,
) -> DiagnoseResult:
    names = [[str(path) for path in paths] for paths in (request.fit, request.validation or request.fit)]
    blind = blind_spots(diagnosis, answer)
    content = diagnosis_json(diagnosis, series.checks, apart, blind, robot.name, *names)
    content |= more.as_json() | {"evidence": answer_json(answer)}
    return DiagnoseResult(robot, diagnosis, answer, series, apart, blind, content, folder, more)


def _apart(
    robot: Robot, request: DiagnoseRequest, diagnosis: Diagnosis, conditions: Conditions, steps: Steps
) -> tuple[TellingApart, ...]:
    """Motions for ambiguous findings."""
    if request.evaluations == 0 or not any(f.indistinguishable_from for f in diagnosis.findings):
        return ()
    settings = PlanSettings(conditions, evaluations=request.evaluations)
    with steps.step("Plan the motion that tells them apart") as update:
        return tell_apart(robot, diagnosis, settings, lambda share, score: update(share, ""))


def conditions_of(cell: Path | None) -> Conditions:
    """What a motion has to keep; nothing around the arm where there is no cell file.

    Raises:
        CellFileError: the file cannot be read.
    """
    content = CellFile(format=1) if cell is None else read_cell(cell)
    return Conditions(
        surroundings=content.surroundings, tool=content.watched_tool, tool_speed=content.tool.speed
    )


def _require_validation(request: DiagnoseRequest) -> None:
    if bool(request.validation) == request.split_half:
        raise IdentificationError(
            "the gap has to be shown on data that was not fitted;"
            " allowed: either --validate with another recording, or --split-half"
        )


def model_without(robot: Robot, names: Sequence[str]) -> RegressorModel:
    """The arm's usual model less the named effects.

    Raises:
        IdentificationError: a name that the model does not have.
    """
    model = RegressorModel.of(robot)
    known = [effect.name for effect in model.effects if effect.name != "rigid_body"]
    for name in names:
        if name not in known:
            raise IdentificationError(f"--without {name}; allowed: {', '.join(known)}")
    return RegressorModel(robot, tuple(effect for effect in model.effects if effect.name not in names))


def _examined(robot: Robot, request: DiagnoseRequest, recording: Recording) -> RegressorModel:
    """The model that is examined: with what an accepted one has found, and without what was asked for."""
    model, found = model_without(robot, request.without), request.found
    if request.prior not in (None, FROM_DESCRIPTION):
        found = read_found_model(Path(str(request.prior)), robot)
    if found is None or not found.found:
        return model
    usual = tuple(name for name in found.usual if name not in request.without)
    return extended_model(searching(robot, recording), replace(found, usual=usual))


def prior_of(source: str | None) -> Callable[[BaseParameters], Prior] | None:
    """What ``--prior`` asks for.

    Raises:
        ModelFileError: the file cannot be read.
    """
    if source is None:
        return None
    if source == FROM_DESCRIPTION:
        return described_prior
    path = Path(source)
    accepted = read_model(path)
    return lambda base: prior_from(base, path, accepted)


def _recordings(
    loaded: Sequence[LoadedRecordings], held: Sequence[LoadedRecordings], split: bool
) -> tuple[tuple[Recording, ...], tuple[Recording, ...]]:
    fit = tuple(recording for part in loaded for recording in part.recordings)
    if not split:
        return fit, tuple(recording for part in held for recording in part.recordings)
    halves = [_halves(recording) for recording in fit]
    return tuple(first for first, _ in halves), tuple(second for _, second in halves)


def _halves(recording: Recording) -> tuple[Recording, Recording]:
    middle = recording.time.shape[0] // 2
    first, second = slice(None, middle), slice(middle, None)
    return _piece(recording, first, "first half"), _piece(recording, second, "second half")


def _piece(recording: Recording, rows: slice, name: str) -> Recording:
    return recording.piece(rows, f"{recording.name}, {name}")


def _write(folder: Path, request: DiagnoseRequest, result: DiagnoseResult) -> None:
    robot, diagnosis = result.robot, result.diagnosis
    text = json.dumps(result.content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    (folder / "diagnosis.json").write_text(text, encoding="utf-8")
    for item in result.apart:
        for name, trajectory in zip(trajectory_names(item.number), item.trajectories, strict=False):
            write_trajectory(folder / name, trajectory, robot)
    fit, validation = ([str(path) for path in paths] for paths in (request.fit, request.validation))
    facts = {"Fitted": ", ".join(fit), "Validated on": ", ".join(validation) or "the second half of each"}
    if request.without:
        facts["Left out of the model"] = ", ".join(request.without)
    known = found_entries(diagnosis.examinations[0].base.model)
    if known:
        facts["Found before"] = found_words(known)
    if request.carried:
        facts["Carried"] = ", ".join(
            f"{one.log}: {one.name}, {one.payload.mass:g} kg" for one in request.carried
        )
    facts["Prior"] = request.prior or "none: after a refit"
    page = DiagnosisContent(
        f"{robot.name}: diagnosis",
        robot,
        diagnosis,
        result.series,
        result.apart,
        result.blind,
        facts,
        result.more.power,
        tuple(map(term_words, result.more.terms)),
        result.more.when,
    )
    write_diagnosis_page(folder / "diagnosis.html", page)
    whole = result.more.model or diagnosis
    write_diagnosed_model(folder / f"{robot.name}.model.toml", whole, request.fit, robot)
