"""The JSON object that ``diagnose --json`` prints; docs/reference/json.md documents it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from typing import Any

from ident.discrepancy import Candidate, Diagnosis, Finding, Gap


def diagnosis_json(
    diagnosis: Diagnosis, robot: str, fit: Sequence[str], validation: Sequence[str]
) -> dict[str, Any]:
    """The diagnosis as a JSON object. A number that is not finite has no JSON form and becomes null.

    Args:
        diagnosis: of the search.
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
        "findings": [_finding(finding) for finding in diagnosis.findings],
        "gap": {
            "torque": _gap(diagnosis.torque),
            "position": None if diagnosis.position is None else _gap(diagnosis.position),
            "control_signal": None if diagnosis.control_signal is None else _gap(diagnosis.control_signal),
            "reason": diagnosis.loop_reason or None,
        },
        "residual": [
            {
                "joint": place.joint + 1,
                "rms": _number(place.rms),
                "shares": {quantity: _number(share) for quantity, share in place.shares},
            }
            for place in diagnosis.habitats
        ],
        "unrepeated": [
            {
                "joint": item.joint + 1,
                "kind": item.kind,
                "p_value": _number(item.p_value),
                "sentence": item.sentence,
            }
            for item in diagnosis.unrepeated
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
                "value": _number(parameter.value),
                "sigma": _number(parameter.sigma),
                "unit": parameter.unit,
            }
            for parameter in finding.parameters
        ],
        "p_value": _number(finding.p_value),
        "score": _number(finding.score),
        "threshold": _number(finding.threshold),
        "held_out_gain": _number(finding.held_out_gain),
        "indistinguishable_from": _names(finding.indistinguishable_from),
        "alternatives": [_candidate(candidate) for candidate in finding.indistinguishable_from],
        "ranking": [_candidate(candidate) for candidate in finding.ranking],
        "gap": _gap(finding.gap),
    }


def _names(candidates: Iterable[Candidate]) -> list[str]:
    """Each effect once, best first."""
    return list(dict.fromkeys(effect for candidate in candidates for effect in candidate.effects))


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "effects": list(candidate.effects),
        "joints": [list(joints) for joints in candidate.joints],
        "score": _number(candidate.score),
        "explained": _number(candidate.explained),
    }


def _gap(gap: Gap) -> dict[str, Any]:
    return {
        "before": [_number(value) for value in gap.before],
        "after": [_number(value) for value in gap.after],
        "floor": [_number(value) for value in gap.floor],
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
