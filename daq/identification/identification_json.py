"""The JSON object that ``identify --json`` and ``demo --json`` print; docs/reference/json.md documents it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import version
from typing import Any

from daq.text.numbers import json_number
from ident.estimators import ESTIMATORS
from ident.results import (
    Consistency,
    DroppedParameter,
    Essential,
    Estimate,
    HeldOut,
    Identification,
    Parameter,
    Rank,
    Signals,
    WorstJoint,
)
from ident.verdicts import Gate, RevisedTest


def identification_json(
    result: Identification, captures: Sequence[str], truth: Mapping[str, float] | None = None
) -> dict[str, Any]:
    """The result as a JSON object. A number that is not finite has no JSON form and becomes null.

    Args:
        result: of the identification.
        captures: where the recordings came from, as the user named them.
        truth: base parameters of a simulated arm by name, SI; None for a real one.
    """
    parameters = result.least_squares.parameters
    return {
        "armhil": version("armhil"),
        "robot": result.robot,
        "captures": list(captures),
        "rows": result.rows,
        "base_parameters": [parameter.name for parameter in parameters],
        "units": {parameter.name: parameter.unit for parameter in parameters},
        "expressions": {parameter.name: parameter.expression for parameter in parameters},
        "found": [entry.as_json() for entry in result.found],
        "estimates": {
            name: _estimate(result.by_estimator[name]) if name in result.by_estimator else None
            for name in ESTIMATORS
        },
        "method": result.method,
        "recommended": result.recommended.method,
        "instrumental_reason": result.instrumental_reason or None,
        "test": _test(result.test),
        "textbook": None if result.textbook is None else _gate(result.textbook),
        "rank": None if result.rank is None else _rank(result.rank),
        "signals": None if result.signals is None else _signals(result.signals),
        "held_out": [_held_out(entry) for entry in result.held_out],
        "consistency": None if result.consistency is None else _consistency(result.consistency),
        "essential": None if result.essential is None else _essential(result.essential),
        "truth": None if truth is None else {name: json_number(value) for name, value in truth.items()},
        "trusted": result.trusted,
        "worst_joint": None if result.worst is None else _worst(result.worst),
        "impossible": list(result.impossible),
        "warnings": list(result.warnings),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {
        "parameters": [_parameter(parameter) for parameter in estimate.parameters],
        "covariance": estimate.covariance_kind,
        "condition": json_number(estimate.condition),
        "relative_error_percent": {
            "total": json_number(estimate.relative_error_percent),
            "per_joint": _numbers(estimate.relative_error_percent_per_joint),
        },
        "torque_rms": _numbers(estimate.torque_rms),
        "lag1_autocorrelation": _numbers(estimate.lag1_autocorrelation),
        "iterations": estimate.iterations,
        "converged": bool(estimate.converged),
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "value": json_number(parameter.value),
        "sigma": json_number(parameter.sigma),
        "percent_sigma": json_number(parameter.percent_sigma),
        "t_value": json_number(parameter.t_value),
        "half_width": json_number(parameter.half_width),
        "unit": parameter.unit,
    }


def _consistency(consistency: Consistency) -> dict[str, Any]:
    return {
        "nearest_to": consistency.nearest_to,
        "distance": json_number(consistency.distance),
        "expected_distance": json_number(consistency.expected_distance),
        "p_value": json_number(consistency.p_value),
        "residual_change_percent": json_number(consistency.residual_change_percent),
        "limits": list(consistency.limits),
        "links": [
            {
                "name": link.name,
                "mass": json_number(link.mass),
                "center": _numbers(link.center),
                "margin": json_number(link.margin),
                "at_limit": bool(link.at_limit),
                "impossible_before": bool(link.impossible_before),
            }
            for link in consistency.links
        ],
        "standard": {name: json_number(value) for name, value in consistency.standard.items()},
    }


def _rank(rank: Rank) -> dict[str, Any]:
    return {
        "structural": rank.structural,
        "data": rank.data,
        "smallest": json_number(rank.smallest),
        "noise_level": json_number(rank.noise_level),
        "unseen": list(rank.unseen),
        "reasons": list(rank.reasons),
    }


def _signals(signals: Signals) -> dict[str, Any]:
    return {
        "cutoff_hz": json_number(signals.cutoff_hz),
        "proposed_cutoff_hz": json_number(signals.proposed_cutoff_hz),
        "position_noise": _numbers(signals.position_noise),
        "quantum": _numbers(signals.quantum),
        "friction_width": json_number(signals.friction_width),
        "proposed_friction_width": json_number(signals.proposed_friction_width),
        "lag": json_number(signals.lag),
        "estimated_lag": json_number(signals.estimated_lag),
        "lag_sigma": json_number(signals.lag_sigma),
    }


def _worst(worst: WorstJoint) -> dict[str, Any]:
    return {
        "joint": worst.joint + 1,
        "relative_error_percent": json_number(worst.error_percent),
        "goes_with": worst.quantity or None,
        "of_joint": worst.joint + 1 if worst.of is None else worst.of + 1,
        "share": json_number(worst.share),
    }


def _held_out(entry: HeldOut) -> dict[str, Any]:
    return {
        "recording": entry.recording,
        "method": entry.method,
        "rows": entry.rows,
        "relative_error_percent": {
            "total": json_number(entry.relative_error_percent),
            "per_joint": _numbers(entry.relative_error_percent_per_joint),
        },
        "torque_rms": _numbers(entry.torque_rms),
    }


def _essential(essential: Essential) -> dict[str, Any]:
    return {
        "parameters": [_parameter(parameter) for parameter in essential.parameters],
        "dropped": [_dropped(parameter) for parameter in essential.dropped],
        "refused": None if essential.refused is None else _dropped(essential.refused),
        "covariance": essential.errors,
    }


def _dropped(parameter: DroppedParameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "percent_sigma": json_number(parameter.percent_sigma),
        "statistic": json_number(parameter.statistic),
        "df": _numbers(parameter.df),
        "p_value": json_number(parameter.p_value),
    }


def _test(test: RevisedTest) -> dict[str, Any]:
    return {
        "verdict": test.verdict,
        "recommendation": test.recommendation,
        "covariance": test.covariance,
        "gates": [_gate(gate) for gate in test.gates],
    }


def _gate(gate: Gate) -> dict[str, Any]:
    return {
        "name": gate.name,
        "null": gate.null,
        "passed": None if gate.passed is None else bool(gate.passed),
        "statistic": json_number(gate.statistic),
        "distribution": gate.distribution,
        "df": None if gate.df is None else _numbers(gate.df),
        "p_value": json_number(gate.p_value),
        "detail": gate.detail,
        "columns": [
            {
                "column": check.column,
                "size": json_number(check.size),
                "limit": json_number(check.limit),
                "p_value": json_number(check.p_value),
                "passed": bool(check.passed),
            }
            for check in gate.columns
        ],
    }


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [json_number(value) for value in values]
