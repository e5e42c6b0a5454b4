"""The JSON objects of ``armhil jog`` and ``armhil home``; docs/reference/json.md documents them."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

from daq.session.bench import ArmOrder
from daq.session.home import HomeResult
from daq.session.jog import JogResult
from daq.session.run import RunResult
from daq.session.session_json import run_json


def jog_json(result: JogResult, order: ArmOrder) -> dict[str, Any]:
    """Of ``armhil jog``: what ``armhil run`` says, and the way."""
    said = run_json(RunResult(result.capture, result.stream, result.run), order)
    return {**said, "joint": result.joint, "from": result.start, "to": result.end}


def home_json(result: HomeResult, order: ArmOrder) -> dict[str, Any]:
    """Of ``armhil home``."""
    return {
        "armhil": version("armhil"),
        "robot": order.robot.name,
        "channel": str(order.channel),
        "run": result.run,
        "searches": [
            {"joint": joint, "outcome": stream.outcome, "reason": stream.reason}
            for joint, stream in result.searches
        ],
        "posture": [float(position) for position in result.posture],
    }
