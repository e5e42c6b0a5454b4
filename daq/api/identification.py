"""Identify an arm, and simulate it with what was identified."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daq.api.frames import frame
from daq.api.picture import Picture, traces
from daq.api.recordings import Log, Place, arm_of
from daq.api.said import said
from daq.identification.identify import IdentifyRequest, run_identify
from daq.identification.terminal import print_identification
from daq.text.progress import Silent
from ident import Estimate, Fitted, Recording
from ident.closed_loop.leading import SimulatedRun
from ident.closed_loop.simulate import simulate as run_loop
from robots import Robot


@dataclass(frozen=True)
class IdentifiedModel:
    """A model of an arm, and whether to trust it.

    Attributes:
        fitted: everything that the identification returns; ``fitted.result`` has every estimate.
        path: the model file; None where none was written.
        report: the page; None where none was written.
    """

    fitted: Fitted
    path: Path | None = None
    report: Path | None = None

    @property
    def arm(self) -> Robot:
        """With the settings that were used."""
        return self.fitted.base.model.robot

    @property
    def estimate(self) -> Estimate:
        """The one that the verdict recommends, or that of the method that was asked for."""
        return self.fitted.result.recommended

    @property
    def verdict(self) -> str:
        """``exogenous``, ``endogenous``, ``instruments_invalid`` or ``not_testable``."""
        return self.fitted.result.test.verdict

    def summary(self, parameters: bool = False) -> str:
        """The answer, a line per joint, what is odd; the parameters and tests where they are asked for."""
        return said(
            lambda console: print_identification(console, self.fitted, model=self.path, parameters=parameters)
        )

    def to_frame(self) -> Any:
        """One row per parameter: value, σ, % σ, half of its 95 % interval, unit, expression (pandas)."""
        found = self.estimate.parameters
        columns = {
            "parameter": [p.name for p in found],
            "value": [p.value for p in found],
            "sigma": [p.sigma for p in found],
            "percent_sigma": [p.percent_sigma for p in found],
            "half_width": [p.half_width for p in found],
            "unit": [p.unit for p in found],
            "expression": [p.expression for p in found],
        }
        return frame(columns, "parameter")

    def plot(self) -> Picture:
        """Measured and predicted torque of each joint."""
        rows, trace = self.fitted.rows, self.fitted.result.trace
        names, units = (
            [joint.name for joint in self.arm.joint],
            [joint.torque_unit for joint in self.arm.joint],
        )
        predicted = np.asarray(rows.regressor @ self.estimate.values)
        lines = {"measured": trace.measured, "predicted": predicted}
        step = float(np.median(np.diff(trace.time)))
        time = np.arange(len(trace.time), dtype=np.float64) * step
        return traces(f"{self.arm.name}: torque", names, units, time, lines)


def identify(
    first: Place | Log,
    *more: Place | Log,
    arm: Robot | Place | None = None,
    columns: Place | None = None,
    validate: Place | Log | tuple[Place | Log, ...] = (),
    out: Place | None = None,
    method: str = "auto",
    **settings: Any,
) -> IdentifiedModel:
    """Identify an arm and say whether the model can be trusted, as ``armhil identify`` does.

    Args:
        first, more: captures or logs; together where there are several.
        arm: name or path; the first capture's own description where None.
        columns: a column map for logs.
        validate: what is predicted and not fitted to.
        out: folder for report, model file and result.
        method: ``auto``, or an estimator.
        settings: further fields of :class:`daq.identification.identify.IdentifyRequest`, as ``friction``.

    Raises:
        UserError: one line that says what to do.
    """
    request = IdentifyRequest(
        tuple(path_of(one) for one in (first, *more)),
        arm_of(arm, first),
        None if columns is None else Path(columns),
        out=None if out is None else Path(out),
        method=method,
        validate=tuple(path_of(one) for one in (validate if isinstance(validate, tuple) else (validate,))),
        **settings,
    )
    done = run_identify(request, Silent())
    return IdentifiedModel(done.fitted, done.model, done.report)


def path_of(one: Place | Log) -> Path:
    return one.path if isinstance(one, Log) else Path(one)


@dataclass(frozen=True)
class Simulation:
    """The simulated closed loop beside what was recorded.

    Attributes:
        arm: the arm.
        recording: whose references led it.
        run: what the simulated arm did, samples × joints.
    """

    arm: Robot
    recording: Recording
    run: SimulatedRun

    def summary(self) -> str:
        """rms of what simulation and measurement differ by, per joint."""
        names, units = [joint.name for joint in self.arm.joint], [joint.unit for joint in self.arm.joint]
        away = np.sqrt(np.mean((self.run.position - self.recording.position) ** 2, axis=0))
        lines = [f"{name}: {value:.3g} {unit}" for name, value, unit in zip(names, away, units, strict=True)]
        return "\n".join(["Position, simulated less measured, rms:", *(f"  {line}" for line in lines)])

    def to_frame(self) -> Any:
        """One row per sample: measured and simulated position per joint (pandas)."""
        columns: dict[str, Any] = {"t": self.run.time}
        for axis, joint in enumerate(self.arm.joint):
            columns[f"q_{joint.name}"] = self.recording.position[:, axis]
            columns[f"simulated_{joint.name}"] = self.run.position[:, axis]
        return frame(columns)

    def plot(self) -> Picture:
        """What simulation and measurement differ by."""
        names, units = [joint.name for joint in self.arm.joint], [joint.unit for joint in self.arm.joint]
        away = {"simulated less measured": self.run.position - self.recording.position}
        return traces(f"{self.arm.name}: simulation", names, units, self.run.time, away)


def simulate(model: IdentifiedModel, log: Log) -> Simulation:
    """The closed loop of the identified arm under the references of a recording.

    Args:
        model: of the same arm.
        log: with references; its first piece is taken.

    Raises:
        IdentificationError: no references, or the loop cannot be simulated.
    """
    base, recording = model.fitted.base, log.loaded.recordings[0]
    standard = base.standard_from(model.estimate.values, base.model.prior())
    return Simulation(model.arm, recording, run_loop(base.model, standard, recording))
