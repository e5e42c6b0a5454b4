"""The second half of a check: the model beside the baseline and the nights since, and a verdict."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from daq.catalogue import checks, models, runs
from daq.catalogue.checks import INCREASED
from daq.catalogue.values import Baseline, Model
from daq.check.carried import lost_words
from daq.check.nights import compare_nights, night_of, nights_since
from daq.check.recorded import TRAJECTORY_SHA256, Recorded
from daq.check.reported import write_check_report
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.check.residual import ResidualIncrease, residual_increase_words, residual_increases
from daq.diagnosis.diagnose import run_diagnose
from daq.diagnosis.diagnose_result import DiagnoseRequest
from daq.files.found_model import found_json
from daq.files.model_file import SUFFIX
from daq.identification.results import write_results
from daq.importing.captures import capture_recordings
from daq.keeping.accepted_effects import effects_of
from daq.keeping.again import IDENTIFY
from daq.keeping.keep import Provenance, keep_diagnose_request, keep_identified
from daq.recording.reader import read_capture
from daq.recording.run_facts import report_facts
from daq.text.numbers import json_value
from daq.text.progress import Steps
from ident import Fitted
from ident.drift import UNEXPLAINED, Comparison

INVALID = "instruments_invalid"
"""Verdict of the revised test on a model that leaves something out."""


def judge_check(request: CheckRequest, recorded: Recorded, fitted: Fitted, steps: Steps) -> CheckResult:
    """Keep the model, compare it, keep the verdict.

    Raises:
        CatalogueError: it cannot be written.
        IdentificationError: the model has other parameters than the baseline's.
    """
    catalogue, robot = request.catalogue, request.arm.robot
    with steps.step("Compare with the baseline"):
        capture = read_capture(recorded.capture)
        recordings = capture_recordings(capture)
        title = f"{recorded.arm.label}: check"
        report = write_results(
            request.folder,
            robot,
            fitted,
            [recorded.capture],
            recordings,
            title=title,
            facts=report_facts(capture),
        )
        settings: dict[str, Any] = {"command": IDENTIFY}
        if fitted.known is not None:
            settings["model"] = found_json(fitted.known)
        provenance = Provenance(
            robot, [recorded.capture], settings, request.folder / f"{robot.name}{SUFFIX}", report
        )
        model = keep_identified(catalogue, fitted, provenance, recorded.run)
        before = checks.of_arm(catalogue, recorded.arm.id, limit=1)
        baseline = recorded.compared_with(catalogue)
        sha256 = str(runs.get(catalogue, recorded.run).facts[TRAJECTORY_SHA256])
        warnings = list(recorded.warnings)
        compared = None
        increase: ResidualIncrease = ()
        if baseline is not None:
            compared, lost = _compared(request, recorded, fitted, model, baseline, sha256)
            increase = residual_increases(catalogue, baseline, model, sha256)
            warnings += [
                *lost_words(baseline.run_id, lost),
                *residual_increase_words(increase),
                *_suspicions(baseline, recorded),
            ]
    findings: tuple[str, ...] = ()
    if compared is not None and request.search and (increase or _is_unexplained(compared)):
        findings = _searched(request, recorded, baseline, steps)
    verdict, sentence = _verdict(compared, fitted, recorded.run, increase, findings)
    if baseline is not None and baseline.state == "suspect" and verdict is Verdict.OK:
        verdict = Verdict.WARNING
        sentence = f"{warnings[-1]}; {sentence}"
    accepted = None if baseline is None else models.get(catalogue, baseline.model_id)
    details = _details(request, recorded, sha256, compared, warnings, findings)
    details["state"] = night_state(compared, fitted, accepted)
    details[INCREASED] = [joint for joint, _ in increase]
    kept = checks.add(
        catalogue,
        recorded.run,
        verdict.value,
        sentence,
        details,
        model_id=model.id,
        baseline_id=None if baseline is None else baseline.id,
    )
    write_check_report(report, robot, fitted, recordings, title, report_facts(capture), kept, baseline)
    return CheckResult(
        recorded.arm.label,
        verdict,
        sentence,
        tuple(warnings),
        recorded.run,
        model.id,
        kept.id,
        baseline,
        compared,
        fitted,
        recorded.capture,
        report,
        findings,
        before[0].verdict if before else "",
        request.settings.tolerance,
    )


def _compared(
    request: CheckRequest, recorded: Recorded, fitted: Fitted, model: Model, baseline: Baseline, sha256: str
) -> tuple[Comparison, tuple[str, ...]]:
    """The comparison, and parameters of the baseline that it leaves out."""
    tonight = replace(
        night_of(runs.get(request.catalogue, model.run_id), model, None),
        celsius=None if recorded.celsius is None else np.array(recorded.celsius),
    )
    history = nights_since(request.catalogue, baseline, sha256, fitted.base.names)
    return compare_nights(request.catalogue, baseline, [*history, tonight], fitted, request.settings)


def _suspicions(baseline: Baseline, recorded: Recorded) -> list[str]:
    if baseline.state != "suspect":
        return []
    said = baseline.events[-1]
    by = f"{said.author}, {said.at:%Y-%m-%d}"
    return [f"the baseline of arm {recorded.arm.label} is SUSPECT: {said.reason} ({by})"]


def _is_unexplained(compared: Comparison) -> bool:
    """Whether something has moved that no known effect explains."""
    if compared.state != "changed":
        return False
    left = compared.unexplained
    return not compared.changes or (left is not None and left.p_value < UNEXPLAINED)


def _searched(
    request: CheckRequest, recorded: Recorded, baseline: Baseline | None, steps: Steps
) -> tuple[str, ...]:
    """Sentences of a discrepancy search on tonight's recording, with the accepted model as what was known."""
    model = None if baseline is None else models.get(request.catalogue, baseline.model_id)
    accepted = None if model is None else model.file
    found = DiagnoseRequest(
        fit=(recorded.capture,),
        robot=request.arm.source,
        split_half=True,
        prior=accepted if accepted is not None and Path(accepted).exists() else None,
        out=request.folder / "diagnosis",
        evaluations=0,
        found=None if model is None else effects_of(model),
    )
    result = run_diagnose(found, steps)
    keep_diagnose_request(request.catalogue, found, result)
    return tuple(finding.words() for finding in result.diagnosis.findings)


def _verdict(
    compared: Comparison | None,
    fitted: Fitted,
    run: int,
    increase: ResidualIncrease,
    findings: tuple[str, ...],
) -> tuple[Verdict, str]:
    if compared is None:
        return (
            Verdict.UNKNOWN,
            f"no baseline to compare with; `armhil baseline accept {run}` makes this one it",
        )
    said = compared.sentence
    if findings:
        said = f"{said}; the search found: {'; '.join(findings)}"
    if compared.state == "changed":
        return (Verdict.FAILED if compared.large and not compared.doubtful else Verdict.WARNING), said
    if findings:
        return Verdict.WARNING, said
    if increase:
        return Verdict.WARNING, f"{residual_increase_words(increase)[0]}; {said}"
    if fitted.result.impossible:
        return Verdict.WARNING, f"the model does not explain the arm ({fitted.result.impossible[0]}); {said}"
    if not fitted.result.trusted:
        return Verdict.WARNING, f"the model does not explain the arm (instruments invalid); {said}"
    return Verdict.OK, said


def night_state(compared: Comparison | None, fitted: Fitted, accepted: Model | None) -> str:
    """``changed``, ``unchanged``, or ``doubtful``: nothing has moved, and the model does not explain the arm.

    Only an unchanged night teaches what is usual. Where the accepted model has invalid instruments too, a
    night with them is as accepted.
    """
    if compared is None or accepted is None:
        return "unchanged"
    found = fitted.result
    as_accepted = accepted.verdict == found.test.verdict == INVALID and not found.impossible
    doubtful = compared.state == "unchanged" and not found.trusted and not as_accepted
    return "doubtful" if doubtful else compared.state


def _details(
    request: CheckRequest,
    recorded: Recorded,
    sha256: str,
    compared: Comparison | None,
    warnings: list[str],
    findings: tuple[str, ...],
) -> dict[str, Any]:
    return {
        TRAJECTORY_SHA256: sha256,
        "celsius": None if recorded.celsius is None else list(recorded.celsius),
        "warnings": warnings,
        "findings": list(findings),
        "settings": asdict(request.settings),
        "comparison": None if compared is None else comparison_json(compared),
    }


def comparison_json(compared: Comparison) -> dict[str, Any]:
    """A comparison as JSON has it (docs/reference/json.md)."""
    return {str(key): json_value(value) for key, value in asdict(compared).items()}
