"""Find what a model lacks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daq.api.frames import frame
from daq.api.identification import IdentifiedModel, path_of
from daq.api.picture import Picture, traces
from daq.api.recordings import Log, Place, arm_of
from daq.api.said import said
from daq.diagnosis.diagnose import run_diagnose
from daq.diagnosis.diagnose_result import DiagnoseRequest, DiagnoseResult
from daq.diagnosis.diagnosis_terminal import print_diagnosis
from daq.text.progress import Silent
from ident.discrepancy import Finding
from robots import Robot
from robots.errors import UserError


class NoModelFile(UserError):
    """A prior was given that was never written; one line."""


@dataclass(frozen=True)
class Diagnosed:
    """What a search found.

    Attributes:
        result: everything that ``armhil diagnose`` returns.
    """

    result: DiagnoseResult

    @property
    def verdict(self) -> str:
        """``clean``, ``named``, ``ambiguous``, ``not_confirmed`` or ``unnamed``."""
        return self.result.diagnosis.verdict

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Effects with their joints and parameters, in the order they were found."""
        return self.result.diagnosis.findings

    def summary(self, parameters: bool = False) -> str:
        """The answer, a line per joint, what is odd."""
        one = self.result
        return said(
            lambda console: print_diagnosis(
                console, one.diagnosis, one.series.checks, one.apart, one.blind, details=parameters
            )
        )

    def to_frame(self) -> Any:
        """One row per parameter of each finding (pandas)."""
        rows = [(found, parameter) for found in self.findings for parameter in found.parameters]
        return frame(
            {
                "effect": [found.effect for found, _ in rows],
                "joints": [found.joints for found, _ in rows],
                "parameter": [parameter.name for _, parameter in rows],
                "value": [parameter.value for _, parameter in rows],
                "sigma": [parameter.sigma for _, parameter in rows],
                "unit": [parameter.unit for _, parameter in rows],
            }
        )

    def plot(self) -> Picture:
        """Torque gap of each joint on data that was not fitted: before, after, and the floor, N·m or N."""
        gap, arm = self.result.diagnosis.torque, self.result.robot
        names, units = [joint.name for joint in arm.joint], [joint.torque_unit for joint in arm.joint]
        steps = np.arange(2.0)
        gone = {"gap": np.vstack([gap.before, gap.after]), "floor": np.vstack([gap.floor, gap.floor])}
        return traces("Torque gap before and after", names, units, steps, gone, "model")


def diagnose(
    first: Place | Log,
    *more: Place | Log,
    validate: Place | Log | tuple[Place | Log, ...] = (),
    arm: Robot | Place | None = None,
    prior: Place | IdentifiedModel | None = None,
    split_half: bool = False,
    without: tuple[str, ...] = (),
    out: Place | None = None,
) -> Diagnosed:
    """Find the effect that the model lacks, as ``armhil diagnose`` does.

    Args:
        first, more: to find it on.
        validate: to show the gap on; needed unless ``split_half``.
        arm: name or path; the first capture's own description where None.
        prior: an accepted model: a file, one that was identified with ``out``, or ``"cad"``.
        split_half: show the gap on the second half of each recording.
        without: effects to leave out of the model that is examined.
        out: folder for the page and the model file with the effect.

    Raises:
        UserError: one line that says what to do.
    """
    if isinstance(prior, IdentifiedModel):
        if prior.path is None:
            raise NoModelFile("prior: this model was not written; identify(…, out=FOLDER) writes it")
        prior = prior.path
    given = validate if isinstance(validate, tuple) else (validate,)
    request = DiagnoseRequest(
        tuple(path_of(one) for one in (first, *more)),
        tuple(path_of(one) for one in given),
        arm_of(arm, first),
        split_half=split_half,
        without=without,
        prior=None if prior is None else str(prior),
        out=None if out is None else Path(out),
        evaluations=0,
    )
    return Diagnosed(run_diagnose(request, Silent()))
