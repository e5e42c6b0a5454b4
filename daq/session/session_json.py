"""The JSON objects of ``armhil run``, ``commission``, ``jog`` and ``home`` (docs/reference/json.md)."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from daq.session.bench import ArmOrder
from daq.session.commission import StageDone
from daq.session.dry_run import CommissionRequest, Planned
from daq.session.home import HomeResult
from daq.session.jog import JogResult
from daq.session.run import RunResult


def run_json(result: RunResult, order: ArmOrder) -> dict[str, Any]:
    """Of ``armhil run``."""
    stream = result.stream
    return {
        "armhil": version("armhil"),
        "robot": order.robot.name,
        "channel": str(order.channel),
        "run": result.run,
        "capture": str(result.capture),
        "outcome": stream.outcome,
        "reason": stream.reason,
        "cycles": stream.cycles,
        "missed_cycles": stream.missed_cycles,
        "late_cycles": stream.late_cycles,
        "incomplete_cycles": stream.incomplete_cycles,
        "doubtful": list(stream.doubtful),
        "pauses": list(stream.pauses),
        "at_rest": not stream.rest_unconfirmed,
        "torque_off": not stream.torque_unconfirmed,
    }


def commission_json(
    planned: Planned, done: Sequence[StageDone], request: CommissionRequest
) -> dict[str, Any]:
    """Of ``armhil commission``: where each stage stood at the beginning, and what was gone through."""
    return {
        "armhil": version("armhil"),
        "robot": request.arm.robot.name,
        "channel": str(request.arm.channel),
        "trajectory": str(planned.file),
        "trajectory_sha256": planned.sha256,
        "cell_sha256": request.cell.sha256 or None,
        "stages": [_stage(planned, k) for k in range(len(planned.states))],
        "done": [
            {
                "stage": stage.name,
                "run": stage.run,
                "capture": None if stage.capture is None else str(stage.capture),
                "detail": stage.words,
            }
            for stage in done
        ],
    }


def _stage(planned: Planned, k: int) -> dict[str, Any]:
    status = planned.states[k]
    wanted = planned.estimates.get(status.name)
    return {
        "stage": status.name,
        "state": status.state,
        "run": None if status.run is None else status.run.id,
        "seconds": None if wanted is None else wanted.seconds,
        "bytes": None if wanted is None else wanted.size,
    }


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
