"""The curves of one run, made again from its recording and its model."""

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path

import numpy as np

from daq.catalogue.values import Model, Run
from daq.files.checksum import file_sha256
from daq.importing.captures import loaded_capture
from daq.keeping.accepted_effects import regressor_of
from daq.recording.capture import Capture, CaptureError
from daq.recording.described_arm import robot_of
from daq.recording.reader import read_capture
from daq.report.gates import GateView, gate_view
from daq.report.parameters import joint_heading
from daq.report.traces import TraceFigure, pixels_per_trace, position_figure, trace_figure
from daq.text.numbers import percent
from ident import IdentificationError, base_parameters
from ident.identification.found_effects import end_to_end
from ident.preparation.observation import observe
from ident.verdicts import ColumnCheck, Gate
from robots import Robot, RobotFileError


class Curves:
    """Position and torque of a run; empty, with a reason, where they cannot be made."""

    def __init__(
        self, position: tuple[TraceFigure, ...] = (), torque: tuple[TraceFigure, ...] = (), reason: str = ""
    ) -> None:
        self.position = position
        self.torque = torque
        self.reason = reason


def curves_of(run: Run, model: Model | None) -> Curves:
    """Positions beside their references, and torques beside what the model makes of the motion."""
    if run.capture is None or run.capture_sha256 is None:
        return Curves(reason="nothing was recorded, or the recording was deleted")
    return _curves(run.capture, run.capture_sha256, _Kept(model))


class _Kept:
    """A model in the cache: one of the same run and number is the same."""

    def __init__(self, model: Model | None) -> None:
        self.model = model
        self._key = None if model is None else (model.id, model.run_id, model.created)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Kept) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=16)
def _curves(path: str, sha256: str, kept: _Kept) -> Curves:
    file = Path(path)
    try:
        if not file.is_file() or file_sha256(file) != sha256:
            return Curves(reason="the recording is gone, or another file is in its place")
        capture = read_capture(file)
        with tempfile.TemporaryDirectory(prefix="armhil-") as folder:
            robot = robot_of(capture, Path(folder))
            return Curves(_positions(capture, robot), _torques(capture, robot, kept.model))
    except (CaptureError, RobotFileError, IdentificationError, OSError, ValueError) as error:
        return Curves(reason=" ".join(str(error).split()))


def _positions(capture: Capture, robot: Robot) -> tuple[TraceFigure, ...]:
    samples = capture.samples
    time = np.asarray(samples.cycle * capture.period, dtype=np.float64)
    return tuple(
        position_figure(
            j,
            joint.name,
            joint.unit,
            time,
            samples.position[:, j],
            samples.reference[:, j],
        )
        for j, joint in enumerate(robot.joint)
    )


def _torques(capture: Capture, robot: Robot, model: Model | None) -> tuple[TraceFigure, ...]:
    if model is None:
        return ()
    base = base_parameters(regressor_of(model, robot))
    if base.names != tuple(parameter.name for parameter in model.parameters):
        return ()
    rows = observe(base, end_to_end(loaded_capture(capture, robot).recordings), robot.identification)
    predicted = rows.regressor @ np.array([parameter.value for parameter in model.parameters])
    pixels = pixels_per_trace(3 * robot.n)
    found = []
    for j, joint in enumerate(robot.joint):
        measured, told = rows.torque[:, j], predicted[:, j]
        size = float(np.linalg.norm(measured))
        share = 100 * float(np.linalg.norm(measured - told)) / max(size, 1e-12)
        heading = joint_heading(j, joint.name)
        numbers = (("relative error", percent(share)),)
        found.append(trace_figure(heading, joint.torque_unit, numbers, rows.time, measured, told, pixels))
    return tuple(found)


def gates_of(model: Model) -> tuple[GateView, ...]:
    """The three gates of a model as the report draws them."""
    gates = []
    for found in model.gates.get("gates", ()):
        columns = tuple(
            ColumnCheck(c["column"], _or_nan(c["size"]), _or_nan(c["limit"]), c["p_value"], c["passed"])
            for c in found["columns"]
        )
        df = None if found["df"] is None else tuple(found["df"])
        gates.append(
            Gate(
                found["name"],
                found["null"],
                found["passed"],
                found["statistic"],
                found["distribution"],
                df,
                found["p_value"],
                found["detail"],
                columns,
            )
        )
    reached = any(gate.name == "exogeneity" and gate.passed is not None for gate in gates)
    return tuple(
        gate_view(gate, number, reached, model.verdict)  # type: ignore[arg-type]
        for number, gate in enumerate(gates, start=1)
    )


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else float(value)
