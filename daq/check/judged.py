"""The second half of a check: the model beside the baseline and the nights since, and a verdict."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from daq.catalogue import baselines, checks, models, runs
from daq.catalogue.again import IDENTIFY
from daq.catalogue.database import Catalogue
from daq.catalogue.keep import Made, keep_diagnose_request, keep_identified
from daq.catalogue.values import Baseline, CheckRecord, Model
from daq.check.carried import carried_over, lost_words
from daq.check.recorded import CELSIUS, TRAJECTORY_SHA256, Recorded
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.check.residual import Grown, grown_residuals, grown_words
from daq.diagnosis.diagnose import DiagnoseRequest, run_diagnose
from daq.files.model_file import SUFFIX
from daq.identification.results import write_results
from daq.identification.run_facts import report_facts
from daq.importing.load import capture_recordings
from daq.progress import Steps
from daq.recording.reader import read_capture
from ident import Fitted
from ident.drift import Comparison, Night, compare, geometry_of
from robots.arrays import FloatArray

_DAY = 86400.0


def judge_check(request: CheckRequest, recorded: Recorded, fitted: Fitted, steps: Steps) -> CheckResult:
    """Keep the model, compare it, keep the verdict.

    Raises:
        CatalogueError: it cannot be written.
        IdentificationError: the model has other parameters than the baseline's.
    """
    catalogue, robot = request.catalogue, request.arm.robot
    with steps.step("Compare with the baseline"):
        capture = read_capture(recorded.capture)
        report = write_results(
            request.folder,
            robot,
            fitted,
            [recorded.capture],
            capture_recordings(capture),
            title=f"{recorded.arm.label}: check",
            facts=report_facts(capture),
        )
        made = Made(
            robot, [recorded.capture], {"command": IDENTIFY}, request.folder / f"{robot.name}{SUFFIX}", report
        )
        model = keep_identified(catalogue, fitted, made, recorded.run)
        before = checks.of_arm(catalogue, recorded.arm.id, limit=1)
        baseline = baselines.current(catalogue, recorded.arm.id)
        warnings = list(recorded.warnings)
        compared = None
        grown: Grown = ()
        if baseline is not None:
            compared, lost = _compared(request, recorded, fitted, model, baseline)
            sha256 = str(runs.get(catalogue, recorded.run).facts[TRAJECTORY_SHA256])
            grown = grown_residuals(catalogue, baseline, model, sha256)
            warnings += [
                *lost_words(baseline.run_id, lost),
                *grown_words(grown),
                *_suspicions(baseline, recorded),
            ]
    findings: tuple[str, ...] = ()
    if compared is not None and request.search and (grown or _is_unexplained(compared)):
        findings = _searched(request, recorded, baseline, steps)
    verdict, sentence = _verdict(compared, fitted, recorded.run, findings)
    if baseline is not None and baseline.state == "suspect" and verdict is Verdict.OK:
        verdict = Verdict.WARNING
        sentence = f"{warnings[-1]}; {sentence}"
    details = _details(request, recorded, compared, warnings, findings)
    kept = checks.add(
        catalogue,
        recorded.run,
        verdict.value,
        sentence,
        details,
        model_id=model.id,
        baseline_id=None if baseline is None else baseline.id,
    )
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
    )


def nights_since(
    catalogue: Catalogue,
    baseline: Baseline,
    trajectory_sha256: str,
    names: tuple[str, ...],
    before: int | None = None,
) -> list[Night]:
    """The checks of an arm since its baseline was accepted that drove the same motion, oldest first.

    Those that found something teach nothing: they are marked as not clean.

    Args:
        before: only checks with a smaller number; all where None.
    """
    known = checks.of_arm(catalogue, baseline.arm_id)
    records = {record.model_id: record for record in known if before is None or record.id < before}
    accepted = models.get(catalogue, baseline.model_id)
    nights = []
    for model in reversed(models.of_arm(catalogue, baseline.arm_id)):
        record = records.get(model.id)
        if record is None or model.id == baseline.model_id or model.method != accepted.method:
            continue
        if record.baseline_id != baseline.id or tuple(p.name for p in model.parameters) != names:
            continue
        if record.details.get(TRAJECTORY_SHA256) == trajectory_sha256 and model.covariance is not None:
            nights.append(night_of(catalogue, model, record))
    return nights


def night_of(catalogue: Catalogue, model: Model, record: CheckRecord | None) -> Night:
    """A model of the catalogue as the comparison takes it."""
    run = runs.get(catalogue, model.run_id)
    celsius = None if record is None else record.details.get("celsius")
    if celsius is None and CELSIUS in run.facts:
        celsius = [float(run.facts[CELSIUS])] * len(model.torque_rms)
    assert model.covariance is not None
    return Night(
        day=run.started.timestamp() / _DAY,
        values=np.array([parameter.value for parameter in model.parameters]),
        covariance=model.covariance,
        celsius=None if celsius is None else np.array(celsius, dtype=np.float64),
        clean=record is None or record.details.get("state") == "unchanged",
        label=f"run {run.id} ({run.started:%Y-%m-%d})",
    )


def _compared(
    request: CheckRequest, recorded: Recorded, fitted: Fitted, model: Model, baseline: Baseline
) -> tuple[Comparison, tuple[str, ...]]:
    """The comparison, and parameters of the baseline that it leaves out."""
    catalogue = request.catalogue
    accepted = models.get(catalogue, baseline.model_id)
    of_baseline = [r for r in checks.of_run(catalogue, baseline.run_id) if r.model_id == accepted.id]
    first = night_of(catalogue, accepted, of_baseline[-1] if of_baseline else None)
    sha256 = str(runs.get(catalogue, recorded.run).facts[TRAJECTORY_SHA256])
    history = nights_since(catalogue, baseline, sha256, fitted.base.names)
    tonight = replace(
        night_of(catalogue, model, None),
        celsius=None if recorded.celsius is None else np.array(recorded.celsius),
    )
    first, lost = carried_over(first, tonight, accepted, fitted.base)
    fit = fitted.least_squares
    geometry = geometry_of(fitted.base, fitted.rows, fit.sigma, first.values)
    return compare(first, [*history, tonight], geometry, request.settings), lost


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
    return not compared.changes or (left is not None and left.p_value < 1e-4)


def _searched(
    request: CheckRequest, recorded: Recorded, baseline: Baseline | None, steps: Steps
) -> tuple[str, ...]:
    """Sentences of a discrepancy search on tonight's recording, with the accepted model as what was known."""
    accepted = None if baseline is None else models.get(request.catalogue, baseline.model_id).file
    found = DiagnoseRequest(
        fit=(recorded.capture,),
        robot=request.arm.source,
        split_half=True,
        prior=accepted if accepted is not None and Path(accepted).exists() else None,
        out=request.folder / "diagnosis",
        evaluations=0,
    )
    result = run_diagnose(found, steps)
    keep_diagnose_request(request.catalogue, found, result)
    return tuple(finding.words() for finding in result.diagnosis.findings)


def _verdict(
    compared: Comparison | None, fitted: Fitted, run: int, findings: tuple[str, ...]
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
        return (Verdict.FAILED if compared.large else Verdict.WARNING), said
    if findings:
        return Verdict.WARNING, said
    if fitted.result.test.verdict == "instruments_invalid":
        return Verdict.WARNING, f"the model does not explain the arm (instruments invalid); {said}"
    return Verdict.OK, said


def _details(
    request: CheckRequest,
    recorded: Recorded,
    compared: Comparison | None,
    warnings: list[str],
    findings: tuple[str, ...],
) -> dict[str, Any]:
    facts = runs.get(request.catalogue, recorded.run).facts
    return {
        TRAJECTORY_SHA256: facts[TRAJECTORY_SHA256],
        "celsius": None if recorded.celsius is None else list(recorded.celsius),
        "warnings": warnings,
        "findings": list(findings),
        "settings": asdict(request.settings),
        "state": "unchanged" if compared is None else compared.state,
        "comparison": None if compared is None else comparison_json(compared),
    }


def comparison_json(compared: Comparison) -> dict[str, Any]:
    """A comparison as JSON has it (docs/reference/json.md)."""
    return {str(key): plain(value) for key, value in asdict(compared).items()}


def plain(value: Any) -> Any:
    """Arrays and tuples as lists; numbers that JSON has not as None."""
    if isinstance(value, dict):
        return {key: plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(part) for part in value]
    if isinstance(value, np.ndarray):
        return [plain(part) for part in _rows(value)]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def _rows(values: FloatArray) -> list[Any]:
    return list(values.tolist())
