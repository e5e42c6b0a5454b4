"""The JSON of an identification: its schema, which others script against, and no number JSON cannot hold."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator

from daq.identification.identification_json import identification_json
from ident import Fitted
from ident.estimators import ALTERNATIVES
from ident.results import (
    Consistency,
    DroppedParameter,
    Essential,
    HeldOut,
    Identification,
    Link,
    Rank,
    Signals,
)
from ident.verdicts import ColumnCheck, Gate, RevisedTest
from robots import Robot
from tests.daq.models import carriage, endogenous

NUMBER = {"type": ["number", "null"]}
NUMBERS = {"type": "array", "items": NUMBER}
TEXT = {"type": "string"}
TEXTS = {"type": "array", "items": TEXT}


def closed(properties: dict[str, Any], optional: frozenset[str] = frozenset()) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": sorted(properties.keys() - optional),
        "additionalProperties": False,
    }


PARAMETER = closed(
    {
        "name": TEXT,
        "value": NUMBER,
        "sigma": NUMBER,
        "percent_sigma": NUMBER,
        "t_value": NUMBER,
        "half_width": NUMBER,
        "unit": TEXT,
    }
)
ESTIMATE = closed(
    {
        "parameters": {"type": "array", "items": PARAMETER, "minItems": 1},
        "condition": NUMBER,
        "relative_error_percent": closed({"total": NUMBER, "per_joint": NUMBERS}),
        "torque_rms": NUMBERS,
        "lag1_autocorrelation": NUMBERS,
        "iterations": {"type": "integer", "minimum": 0},
        "covariance": TEXT,
        "converged": {"type": "boolean"},
    }
)
COLUMN = closed(
    {"column": TEXT, "size": NUMBER, "limit": NUMBER, "p_value": NUMBER, "passed": {"type": "boolean"}}
)
GATE = closed(
    {
        "name": {"enum": ["instruments", "rank", "exogeneity"]},
        "passed": {"type": ["boolean", "null"]},
        "statistic": NUMBER,
        "df": {"anyOf": [NUMBERS, {"type": "null"}]},
        "p_value": {"type": ["number", "null"], "minimum": 0, "maximum": 1},
        "detail": TEXT,
        "null": TEXT,
        "distribution": TEXT,
        "columns": {"type": "array", "items": COLUMN},
    }
)
TEST = closed(
    {
        "verdict": {"enum": ["exogenous", "endogenous", "instruments_invalid", "not_testable"]},
        "recommendation": TEXT,
        "covariance": TEXT,
        "gates": {"type": "array", "items": GATE},
    }
)
OPTIONAL_ESTIMATE = {"anyOf": [ESTIMATE, {"type": "null"}]}
RANK = closed(
    {
        "structural": {"type": "integer"},
        "data": {"type": "integer"},
        "smallest": NUMBER,
        "noise_level": NUMBER,
        "unseen": TEXTS,
        "reasons": TEXTS,
    }
)
SIGNALS = closed(
    {
        "cutoff_hz": NUMBER,
        "proposed_cutoff_hz": NUMBER,
        "position_noise": NUMBERS,
        "quantum": NUMBERS,
        "friction_width": NUMBER,
        "proposed_friction_width": NUMBER,
        "lag": NUMBER,
        "estimated_lag": NUMBER,
        "lag_sigma": NUMBER,
    }
)
METHOD = {"enum": ["ls", "iv", *ALTERNATIVES, "consistent"]}
HELD_OUT = closed(
    {
        "recording": TEXT,
        "method": METHOD,
        "rows": {"type": "integer", "minimum": 1},
        "relative_error_percent": closed({"total": NUMBER, "per_joint": NUMBERS}),
        "torque_rms": NUMBERS,
    }
)
DROPPED = closed(
    {"name": TEXT, "percent_sigma": NUMBER, "statistic": NUMBER, "df": NUMBERS, "p_value": NUMBER}
)
ESSENTIAL = closed(
    {
        "parameters": {"type": "array", "items": PARAMETER},
        "dropped": {"type": "array", "items": DROPPED},
        "refused": {"anyOf": [DROPPED, {"type": "null"}]},
        "covariance": TEXT,
    }
)
LINK = closed(
    {
        "name": TEXT,
        "mass": NUMBER,
        "center": NUMBERS,
        "margin": NUMBER,
        "at_limit": {"type": "boolean"},
        "impossible_before": {"type": "boolean"},
    }
)
CONSISTENCY = closed(
    {
        "nearest_to": METHOD,
        "distance": NUMBER,
        "expected_distance": NUMBER,
        "p_value": NUMBER,
        "residual_change_percent": NUMBER,
        "limits": TEXTS,
        "links": {"type": "array", "items": LINK},
        "standard": {"type": "object", "additionalProperties": NUMBER},
    }
)
BY_NAME = {"type": "object", "additionalProperties": TEXT}
FOUND = closed(
    {
        "effect": TEXT,
        "joints": {"type": "array", "items": {"type": "integer", "minimum": 1}},
        "shape": {"type": "object", "additionalProperties": NUMBER},
    }
)
SCHEMA = closed(
    {
        "armhil": TEXT,
        "robot": TEXT,
        "captures": TEXTS,
        "rows": {"type": "integer", "minimum": 1},
        "base_parameters": TEXTS,
        "found": {"type": "array", "items": FOUND},
        "estimates": closed(
            {
                "ls": ESTIMATE,
                "iv": OPTIONAL_ESTIMATE,
                **dict.fromkeys(ALTERNATIVES, OPTIONAL_ESTIMATE),
                "consistent": OPTIONAL_ESTIMATE,
            }
        ),
        "method": {"enum": ["auto", *METHOD["enum"]]},
        "consistency": {"anyOf": [CONSISTENCY, {"type": "null"}]},
        "recommended": METHOD,
        "rank": {"anyOf": [RANK, {"type": "null"}]},
        "signals": {"anyOf": [SIGNALS, {"type": "null"}]},
        "held_out": {"type": "array", "items": HELD_OUT},
        "essential": {"anyOf": [ESSENTIAL, {"type": "null"}]},
        "test": TEST,
        "units": BY_NAME,
        "expressions": BY_NAME,
        "instrumental_reason": {"type": ["string", "null"]},
        "textbook": {"anyOf": [GATE, {"type": "null"}]},
        "truth": {"anyOf": [{"type": "object", "additionalProperties": NUMBER}, {"type": "null"}]},
        "trusted": {"type": "boolean"},
        "impossible": TEXTS,
        "warnings": TEXTS,
        "worst_joint": closed(
            {
                "joint": {"type": "integer", "minimum": 1},
                "relative_error_percent": NUMBER,
                "goes_with": {"enum": ["position", "speed", "acceleration", "torque", "time", None]},
                "of_joint": {"type": "integer", "minimum": 1},
                "share": NUMBER,
            }
        ),
    }
)


@pytest.fixture(scope="module")
def fitted(emps: Robot) -> Fitted:
    return carriage(emps)


@pytest.fixture(scope="module")
def result(fitted: Fitted) -> Identification:
    return fitted.result


def printed(result: Identification, truth: dict[str, float] | None = None) -> dict[str, Any]:
    """As another program reads it; fails where the schema does not hold."""
    content = identification_json(result, ["runs/first/capture.mcap"], truth)
    read = json.loads(json.dumps(content, allow_nan=False))
    Draft202012Validator.check_schema(SCHEMA)
    Draft202012Validator(SCHEMA).validate(read)
    return read


def test_least_squares_alone(result: Identification) -> None:
    content = printed(result)
    assert content["armhil"] == version("armhil")
    assert content["robot"] == "emps"
    assert content["captures"] == ["runs/first/capture.mcap"]
    assert content["rows"] == result.rows
    assert content["base_parameters"] == [p.name for p in result.least_squares.parameters]
    assert content["estimates"]["iv"] is None
    assert content["test"]["verdict"] == "not_testable"
    assert content["instrumental_reason"] == result.instrumental_reason
    assert content["textbook"] is None
    assert content["truth"] is None


def test_every_digit_of_an_estimate(result: Identification) -> None:
    estimate = result.least_squares
    content = printed(result)["estimates"]["ls"]
    assert [(p["value"], p["sigma"], p["percent_sigma"], p["unit"]) for p in content["parameters"]] == [
        (p.value, p.sigma, p.percent_sigma, p.unit) for p in estimate.parameters
    ]
    assert content["relative_error_percent"]["total"] == estimate.relative_error_percent
    assert content["relative_error_percent"]["per_joint"] == list(estimate.relative_error_percent_per_joint)
    assert content["torque_rms"] == list(estimate.torque_rms)
    assert content["lag1_autocorrelation"] == list(estimate.lag1_autocorrelation)
    assert content["condition"] == estimate.condition


def test_both_estimates_gates_and_truth(fitted: Fitted) -> None:
    check = ColumnCheck("Fv1", 0.01, 0.05, None, np.bool_(True))
    gates = (
        Gate(
            "instruments", "Z = X", np.bool_(True), np.float64(0.01), "F", (3.0, np.inf), None, "", (check,)
        ),
        Gate("rank", "", False, 2.5, "χ²", (4.0,), 0.6, "words"),
        Gate("exogeneity", "", None, None, "", None, None, "not reached"),
    )
    result = endogenous(fitted).result
    test = RevisedTest("endogenous", "Use them.", "AR", gates)
    content = printed(replace(result, test=test, textbook=gates[1]), {"Fv1": 203.5, "Fc1": float("nan")})
    assert content["estimates"]["iv"]["iterations"] == 3
    assert content["instrumental_reason"] is None
    assert [gate["passed"] for gate in content["test"]["gates"]] == [True, False, None]
    assert content["test"]["gates"][0]["df"] == [3.0, None]
    assert content["test"]["gates"][0]["columns"][0]["passed"] is True
    assert content["textbook"]["statistic"] == 2.5
    assert content["truth"] == {"Fv1": 203.5, "Fc1": None}


def test_numbers_that_are_not_finite_become_null(result: Identification) -> None:
    estimate = result.least_squares
    zero = replace(estimate.parameters[0], value=0.0, sigma=float("inf"))
    broken = replace(
        estimate,
        parameters=(zero, *estimate.parameters[1:]),
        condition=float("inf"),
        torque_rms=np.array([np.nan]),
        lag1_autocorrelation=np.array([-np.inf]),
    )
    content = printed(result.with_estimates(broken))["estimates"]["ls"]
    assert content["parameters"][0] == {
        "name": zero.name,
        "value": 0.0,
        "sigma": None,
        "percent_sigma": None,
        "t_value": 0.0,
        "half_width": zero.half_width,
        "unit": zero.unit,
    }
    assert content["condition"] is None
    assert content["torque_rms"] == [None]
    assert content["lag1_autocorrelation"] == [None]


def test_what_the_data_say_beside_the_estimates(result: Identification) -> None:
    dropped = DroppedParameter("off1", 45.0, 1.2, (1.0, 500.0), 0.27)
    parameters = result.least_squares.parameters
    content = printed(
        replace(
            result.with_estimates(replace(result.least_squares, method="robust")),
            method="robust",
            rank=Rank(4, 3, 1e-5, 2e-5, ("off1",), ("joint 1 moves too slowly",)),
            signals=Signals(60.0, 75.0, np.array([1e-6]), np.array([np.nan]), 0.0, 1e-5, 0.0, None, None),
            held_out=(HeldOut("b.mcap", "ls", 900, 4.5, np.array([4.5]), np.array([np.inf])),),
            essential=Essential(parameters[:3], (dropped,), None, "AR"),
        )
    )
    assert content["recommended"] == "robust"
    assert content["estimates"]["robust"]["parameters"] == content["estimates"]["ls"]["parameters"]
    assert content["rank"]["unseen"] == ["off1"]
    assert content["signals"]["quantum"] == [None] and content["signals"]["estimated_lag"] is None
    assert content["held_out"][0]["relative_error_percent"] == {"total": 4.5, "per_joint": [4.5]}
    assert content["held_out"][0]["torque_rms"] == [None]
    assert [p["name"] for p in content["essential"]["parameters"]] == [p.name for p in parameters[:3]]
    assert content["essential"]["dropped"][0]["df"] == [1.0, 500.0]


def test_the_nearest_arm_that_can_exist(result: Identification) -> None:
    link = Link("carriage", 95.1, np.array([0.0, 0.1, 0.0]), 0.7, np.bool_(False), True)  # type: ignore[arg-type]
    consistency = Consistency(
        "ls", 1.7, 4.0, 0.8, 0.02, ("carriage",), (link,), {"M1": 95.1, "Ia1": float("nan")}, "words"
    )
    content = printed(
        replace(
            result.with_estimates(replace(result.least_squares, method="consistent")),
            method="consistent",
            consistency=consistency,
        )
    )
    assert content["recommended"] == "consistent"
    assert content["estimates"]["consistent"]["parameters"] == content["estimates"]["ls"]["parameters"]
    assert content["consistency"]["links"][0]["center"] == [0.0, 0.1, 0.0]
    assert content["consistency"]["links"][0]["impossible_before"] is True
    assert content["consistency"]["standard"] == {"M1": 95.1, "Ia1": None}


def test_every_key_is_documented() -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "json.md").read_text(encoding="utf-8")
    objects = (SCHEMA, PARAMETER, ESTIMATE, COLUMN, GATE, TEST, RANK, SIGNALS, HELD_OUT, DROPPED, ESSENTIAL)
    for key in {key for schema in (*objects, LINK, CONSISTENCY) for key in schema["properties"]}:
        assert re.search(rf'`{key}`|"{key}"', page), key
