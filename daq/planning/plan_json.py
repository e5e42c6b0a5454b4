"""What ``armhil plan --json`` prints; docs/reference/json.md documents it."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

from daq.planning.plan_result import PlanResult
from daq.report.power import power_json
from daq.text.numbers import json_number
from trajectories import Prediction, Use


def plan_json(result: PlanResult) -> dict[str, Any]:
    """One object of plain values; numbers that are not finite are null."""
    trajectory, judgement, robot = result.trajectory, result.judgement, result.robot
    detail, repeat, nearest = trajectory.detail, trajectory.repeat, judgement.nearest
    names = [joint.name for joint in robot.joint]
    power = {} if result.power is None else {"power": power_json(result.power)}
    return {
        "armhil": version("armhil"),
        "robot": robot.name,
        "verdict": result.verdict,
        "problems": [
            {"constraint": p.constraint, "joint": p.joint or None, "time": p.time, "text": str(p)}
            for p in judgement.problems
        ],
        "remarks": list(result.remarks),
        "family": trajectory.family,
        "seed": trajectory.seed,
        "speed": trajectory.speed,
        "duration": trajectory.duration,
        "cycle_time": trajectory.cycle_time,
        "samples": len(trajectory.time),
        "repeat": None if repeat is None else dict(vars(repeat)),
        "criterion": result.objective.criterion,
        "score": json_number(trajectory.score),
        "condition": json_number(detail.condition),
        "log_det": json_number(detail.log_det),
        "trace": json_number(detail.trace),
        "evaluations": detail.evaluations,
        "stopped": result.stopped,
        "limits": [entry for use in judgement.uses for entry in _use(use, names)],
        "nearest": None
        if nearest is None
        else {
            "distance": nearest.distance,
            "at_least": nearest.at_least,
            "bodies": list(nearest.bodies),
            "joint": nearest.joint or None,
            "time": nearest.time,
        },
        "tool": {
            "speed": judgement.tool.speed,
            "time": judgement.tool.time,
            "limit": judgement.tool.limit,
        },
        "rows": None if detail.prediction is None else _rows(detail.prediction, names),
        "parameters": [] if detail.prediction is None else _parameters(detail.prediction),
        "payload": [
            {
                "name": parameter.name,
                "sigma": json_number(sigma),
                "unit": parameter.unit,
            }
            for parameter, sigma in result.payload.items()
        ],
        **power,
        **_for(result),
        "files": {kind: str(path) for kind, path in result.files.items()},
    }


def _for(result: PlanResult) -> dict[str, Any]:
    """The effect that was asked for, beside the smallest size of it that would be named."""
    wanted, smallest = result.wanted, result.smallest
    if wanted is None or smallest is None:
        return {}
    return {
        "for": {
            "effect": wanted.effect,
            "joints": list(wanted.joints),
            "size": wanted.size,
            "unit": smallest.unit,
            "smallest": json_number(smallest.size),
            "named": smallest.names(wanted.size),
        }
    }


def _use(use: Use, names: list[str]) -> list[dict[str, Any]]:
    return [
        {
            "constraint": use.constraint,
            "joint": name,
            "percent": json_number(100.0 * float(use.share[k])),
            "value": float(use.value[k]),
            "limit": float(use.limit[k]),
            "time": float(use.time[k]),
        }
        for k, name in enumerate(names)
    ]


def _rows(prediction: Prediction, names: list[str]) -> dict[str, Any]:
    return {
        "count": prediction.rows,
        "row_time": prediction.row_time,
        "used_percent": {n: 100.0 * float(share) for n, share in zip(names, prediction.used, strict=True)},
        "noise": prediction.noise,
    }


def _parameters(prediction: Prediction) -> list[dict[str, Any]]:
    columns = (
        prediction.names,
        prediction.units,
        prediction.values,
        prediction.sigma,
        prediction.percent_sigma,
    )
    return [
        {
            "name": name,
            "unit": unit,
            "value": float(value),
            "sigma": json_number(sigma),
            "percent_sigma": json_number(percent),
        }
        for name, unit, value, sigma, percent in zip(*columns, strict=True)
    ]
