"""The JSON object that ``diagnose --json`` prints; docs/reference/json.md documents it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.metadata import version
from typing import Any

from daq.diagnosis.apart import TellingApart, Unsettled
from daq.diagnosis.blind_spots import BlindSpot
from daq.diagnosis.settled_by import settled_by
from daq.text.numbers import json_number
from ident.discrepancy import Candidate, Diagnosis, Finding, Gap
from ident.discrepancy.before_after import ModelCheck
from ident.discrepancy.confirmation import Confirmation, Shown
from ident.verdicts import Gate
from robots.arrays import FloatArray
from trajectories.information.separation import Separation


def diagnosis_json(
    diagnosis: Diagnosis,
    checks: Sequence[ModelCheck],
    apart: Sequence[TellingApart],
    blind: Sequence[BlindSpot],
    robot: str,
    fit: Sequence[str],
    validation: Sequence[str],
) -> dict[str, Any]:
    """The diagnosis as a JSON object. A number that is not finite has no JSON form and becomes null.

    Args:
        diagnosis: of the search.
        checks: of the model before anything was found and after each finding.
        apart: what to do about each ambiguous finding.
        blind: what these recordings could not have shown.
        robot: name of the arm.
        fit, validation: where the recordings came from, as the user named them.
    """
    return {
        "armhil": version("armhil"),
        "robot": robot,
        "fit": list(fit),
        "validation": list(validation),
        "verdict": diagnosis.verdict,
        "description": diagnosis.description or None,
        "findings": [
            _finding(finding)
            | _changes(checks[number - 1], checks[number])
            | {"telling_apart": next((_apart(item) for item in apart if item.number == number), None)}
            for number, finding in enumerate(diagnosis.findings, start=1)
        ],
        "not_confirmed": [_finding(finding) for finding in diagnosis.rejected],
        "ranking": [_candidate(candidate) for candidate in diagnosis.ranking],
        "unexplained": [
            {
                "joint": one.joint + 1,
                "error_percent": json_number(100.0 * one.error),
                "noise_percent": json_number(100.0 * one.noise),
                "unexplained_percent": json_number(100.0 * one.share),
                "at_least_percent": json_number(100.0 * one.least),
                "noise_from": "repeats" if one.repeats else "neighbouring rows",
                "nearest": None if nearest is None else _candidate(nearest),
            }
            for one in diagnosis.unexplained
            for nearest in (diagnosis.nearest(one.joint),)
        ],
        **_changes(checks[0], checks[-1]),
        "gap": {
            "torque": _gap(diagnosis.torque),
            "position": None if diagnosis.position is None else _gap(diagnosis.position),
            "control_signal": None if diagnosis.control_signal is None else _gap(diagnosis.control_signal),
            "reason": diagnosis.loop_reason or None,
        },
        "residual": [
            {
                "joint": place.joint + 1,
                "rms": json_number(place.rms),
                "shares": {quantity: json_number(share) for quantity, share in place.shares},
            }
            for place in diagnosis.dependences
        ],
        "notes": list(diagnosis.notes),
        "unrepeated": [
            {
                "joint": item.joint + 1,
                "kind": item.kind,
                "p_value": json_number(item.p_value),
                "sentence": item.sentence,
            }
            for item in diagnosis.unrepeated
        ],
        "blind_spots": [
            {
                "effect": spot.effect,
                "joints": list(spot.joints),
                "smallest": json_number(spot.smallest),
                "sentence": spot.words(),
                "settled_by": spot.settled_by,
            }
            for spot in blind
        ],
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "effect": finding.effect,
        "sentence": finding.words(),
        "scope": finding.scope,
        "joints": list(finding.joints),
        "mode": finding.mode,
        "parameters": [
            {
                "name": parameter.name,
                "value": json_number(parameter.value),
                "sigma": json_number(parameter.sigma),
                "unit": parameter.unit,
            }
            for parameter in finding.parameters
        ],
        "p_value": json_number(finding.p_value),
        "probability": json_number(finding.probability),
        "set": [
            {"effect": one.name, "joints": list(one.joints), "probability": json_number(one.probability)}
            for one in finding.held
        ],
        "score": json_number(finding.score),
        "threshold": json_number(finding.threshold),
        "held_out_gain": json_number(finding.held_out_gain),
        "confirmed": finding.confirmation.passed,
        "confirmation": _confirmation(finding.confirmation),
        "indistinguishable_from": _names(finding.indistinguishable_from),
        "alternatives": [
            _candidate(candidate) | {"settled_by": settled_by((finding.effect, candidate.effect))}
            for candidate in finding.indistinguishable_from
        ],
        "ranking": [_candidate(candidate) for candidate in finding.ranking],
        "gap": _gap(finding.gap),
    }


def _confirmation(confirmation: Confirmation) -> dict[str, Any]:
    return {
        "torque": _shown(confirmation.torque),
        "closed_loop": None if confirmation.loop is None else _shown(confirmation.loop),
        "reason": confirmation.reason or None,
    }


def _shown(shown: Shown) -> dict[str, Any]:
    return {"share": json_number(shown.share), "sigma": json_number(shown.sigma)}


def _changes(before: ModelCheck, after: ModelCheck) -> dict[str, Any]:
    """Relative errors and gate 1, before and after."""
    return {
        "relative_error_percent": {
            rows: {"before": _list(getattr(before, rows)), "after": _list(getattr(after, rows))}
            for rows in ("identified", "moving", "held_out")
        },
        "gate_1": {
            "before": None if before.gate is None else _gate(before.gate),
            "after": None if after.gate is None else _gate(after.gate),
            "reason": before.reason or after.reason or None,
        },
    }


def _gate(gate: Gate) -> dict[str, Any]:
    return {
        "passed": bool(gate.passed),
        "p_value": json_number(gate.p_value),
        "detail": gate.detail,
        "checks": [
            {
                "of": check.column,
                "size": json_number(check.size),
                "limit": json_number(check.limit),
                "p_value": json_number(check.p_value),
                "passed": check.passed,
            }
            for check in gate.columns
        ],
    }


def _apart(item: TellingApart) -> dict[str, Any]:
    fit, validate = trajectory_names(item.number) if item.parts else (None, None)
    durations: list[float | None] = [one.duration for one in item.trajectories]
    first, second = durations or [None, None]
    return {
        "candidates": list(item.candidates),
        "trajectory": fit,
        "validation_trajectory": validate,
        "duration": first,
        "validation_duration": second,
        "pairs": [_pair(before, after) for before, after in item.pairs],
        "not_by_motion": [_unsettled(pair) for pair in item.unsettled],
        "not_planned": item.not_planned or None,
    }


def trajectory_names(number: int) -> tuple[str, str]:
    """Files of the motion for an ambiguous finding, beside the page: the part to fit, the one to validate."""
    return f"tell-apart-{number}.trajectory.json", f"tell-apart-{number}-validate.trajectory.json"


def _pair(before: Separation, after: Separation) -> dict[str, Any]:
    return {
        "between": [after.first, after.second],
        "correlation": {"before": json_number(before.correlation), "after": json_number(after.correlation)},
    }


def _unsettled(pair: Unsettled) -> dict[str, Any]:
    return {"between": [pair.first, pair.second], "why": pair.why, "settled_by": pair.settled_by}


def _list(values: FloatArray) -> list[float | None]:
    return [json_number(value) for value in values]


def _names(candidates: Iterable[Candidate]) -> list[str]:
    """Each effect once, best first."""
    return list(dict.fromkeys(candidate.effect for candidate in candidates))


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "effects": [candidate.effect],
        "joints": [list(candidate.joints)],
        "score": json_number(candidate.score),
        "probability": json_number(candidate.probability),
    }


def _gap(gap: Gap) -> dict[str, Any]:
    return {
        "before": [json_number(value) for value in gap.before],
        "after": [json_number(value) for value in gap.after],
        "floor": [json_number(value) for value in gap.floor],
    }
