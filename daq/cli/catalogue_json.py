"""The JSON objects of the commands on the catalogue; docs/reference/json.md documents them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from daq.catalogue.details import RunDetails
from daq.catalogue.values import Baseline, CatalogueFinding, CheckRecord, Model, Run
from daq.text.numbers import json_number
from daq.text.parameter_rows import parameter_rows

if TYPE_CHECKING:  # what makes them takes long to import
    from daq.keeping.again import Rerun
    from daq.keeping.compare import ComparedParameter, Comparison
    from daq.keeping.prune import PrunePlan


def runs_json(runs: Iterable[Run], verdicts: Mapping[int, str]) -> dict[str, Any]:
    """Of ``armhil runs``; ``verdicts`` are those of checks, by number of the run."""
    found = [{**run_json(run), "verdict": verdicts.get(run.id)} for run in runs]
    return {"armhil": version("armhil"), "runs": found}


def run_json(run: Run) -> dict[str, Any]:
    """One run; times are ISO 8601 in UTC."""
    return {
        "run": run.id,
        "arm": run.arm,
        "kind": run.kind,
        "stage": run.stage or None,
        "started": _time(run.started),
        "finished": _time(run.finished),
        "who": run.who,
        "state": run.state,
        "outcome": run.outcome or None,
        "reason": run.reason or None,
        "trajectory": run.trajectory or None,
        "capture": run.capture,
        "capture_sha256": run.capture_sha256,
        "description_sha256": run.description_sha256,
        "facts": dict(run.facts),
        "note": run.note or None,
    }


def details_json(details: RunDetails) -> dict[str, Any]:
    """Of ``armhil show`` and ``armhil note``."""
    return {
        "armhil": version("armhil"),
        **run_json(details.run),
        "capture_state": details.capture,
        "models": [model_json(model) for model in details.models],
        "findings": [finding_json(finding) for finding in details.findings],
        "checks": [_check(check) for check in details.checks],
        "baselines": [_baseline(baseline) for baseline in details.baselines],
    }


def model_json(model: Model) -> dict[str, Any]:
    """One model."""
    return {
        "model": model.id,
        "run": model.run_id,
        "created": _time(model.created),
        "who": model.who,
        "method": model.method,
        "verdict": model.verdict,
        "recommendation": model.recommendation,
        "rows": model.rows,
        "relative_error_percent": json_number(model.relative_error_percent),
        "torque_rms": [json_number(value) for value in model.torque_rms],
        "effects": list(model.effects),
        "found": [entry.as_json() for entry in model.found],
        "parameters": parameter_rows(model.parameters),
        "covariance": model.covariance_kind,
        "settings": dict(model.settings),
        "sources": [{"path": source.path, "sha256": source.sha256} for source in model.sources],
        "description_sha256": model.description_sha256,
        "made_by": model.armhil,
        "file": model.file,
        "report": model.report,
    }


def finding_json(finding: CatalogueFinding) -> dict[str, Any]:
    """One finding."""
    return {
        "effect": finding.effect,
        "joints": list(finding.joints),
        "sentence": finding.sentence,
        "parameters": [dict(parameter) for parameter in finding.parameters],
        "p_value": json_number(finding.p_value),
        "gap_before": json_number(finding.gap_before),
        "gap_after": json_number(finding.gap_after),
        "held_out_gain": json_number(finding.held_out_gain),
        "model": finding.model_id,
    }


def rerun_json(rerun: Rerun) -> dict[str, Any]:
    """Of ``armhil rerun``."""
    result = rerun.result.fitted.result
    estimate = result.recommended
    return {
        "armhil": version("armhil"),
        "analysis": "identification",
        "run": rerun.run.id,
        "model": None if rerun.earlier is None else rerun.earlier.id,
        "sameness": rerun.sameness,
        "largest_difference": json_number(rerun.largest),
        "largest_parameter": rerun.largest_name or None,
        "remarks": list(rerun.remarks),
        "method": estimate.method,
        "verdict": result.test.verdict,
        "rows": result.rows,
        "parameters": parameter_rows(estimate.parameters),
        "report": None if rerun.result.report is None else str(rerun.result.report),
    }


def comparison_json(comparison: Comparison) -> dict[str, Any]:
    """Of ``armhil compare``."""
    torque = comparison.torque
    return {
        "armhil": version("armhil"),
        "runs": [run.id for run in comparison.runs],
        "models": [model.id for model in comparison.models],
        "arms": [run.arm for run in comparison.runs],
        "verdicts": [model.verdict for model in comparison.models],
        "relative_error_percent": [json_number(m.relative_error_percent) for m in comparison.models],
        "torque_rms": [[json_number(value) for value in model.torque_rms] for model in comparison.models],
        "parameters": [_compared(parameter) for parameter in comparison.parameters],
        "only_first": list(comparison.only_first),
        "only_second": list(comparison.only_second),
        "torque_difference": None
        if torque is None
        else {"rms": torque.rms.tolist(), "share_percent": torque.share_percent.tolist()},
        "torque_reason": comparison.torque_reason or None,
        "remarks": list(comparison.remarks),
    }


def prune_json(plan: PrunePlan, *, dry_run: bool) -> dict[str, Any]:
    """Of ``armhil prune``."""
    return {
        "armhil": version("armhil"),
        "dry_run": dry_run,
        "deleted": [
            {"run": entry.run.id, "capture": str(entry.path), "bytes": entry.size} for entry in plan.prunable
        ],
        "kept": [
            {"run": entry.run.id, "capture": entry.run.capture, "reason": entry.reason} for entry in plan.kept
        ],
    }


def _compared(parameter: ComparedParameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "unit": parameter.unit,
        "values": [json_number(parameter.first.value), json_number(parameter.second.value)],
        "sigmas": [json_number(parameter.first.sigma), json_number(parameter.second.sigma)],
        "difference": json_number(parameter.difference),
        "difference_in_sigma": json_number(parameter.sigmas),
    }


def _check(check: CheckRecord) -> dict[str, Any]:
    return {
        "created": _time(check.created),
        "verdict": check.verdict,
        "sentence": check.sentence,
        "details": dict(check.details),
        "model": check.model_id,
        "baseline": check.baseline_id,
    }


def _baseline(baseline: Baseline) -> dict[str, Any]:
    return {
        "baseline": baseline.id,
        "model": baseline.model_id,
        "state": baseline.state,
        "events": [
            {
                "state": event.state,
                "author": event.author,
                "reason": event.reason,
                "report": event.report,
                "at": _time(event.at),
            }
            for event in baseline.events
        ],
    }


def _time(time: datetime | None) -> str | None:
    return None if time is None else time.isoformat(timespec="milliseconds")
