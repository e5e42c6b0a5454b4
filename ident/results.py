"""What an identification returns: small frozen values, nothing that computes.

Symbols are those of the paper: β̂ with its covariance Σ̂ (eq. 7), y (r×1), X (r×b).
Arrays over time are samples × joints.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from robots.arrays import FloatArray

Verdict = Literal["exogenous", "endogenous", "instruments_invalid", "not_testable"]
GateName = Literal["instruments", "rank", "exogeneity"]


@dataclass(frozen=True)
class Parameter:
    """One estimated base parameter with its standard deviation, SI units."""

    name: str
    value: float
    sigma: float
    unit: str
    expression: str
    """The regrouping relation, e.g. ``ZZ1 + Ia1 + YY2``."""

    @property
    def percent_sigma(self) -> float:
        """100·σ/|β|, the field's measure of how well a parameter is seen."""
        return 100.0 * self.sigma / abs(self.value) if self.value else float("inf")


@dataclass(frozen=True)
class Estimate:
    """One estimator's answer on one set of rows."""

    method: Literal["ls", "iv"]
    parameters: tuple[Parameter, ...]
    covariance: FloatArray
    covariance_kind: str
    condition: float
    relative_error_percent: float
    relative_error_percent_per_joint: FloatArray
    torque_rms: FloatArray
    """rms of the torque residual per joint, N·m (or N)."""
    lag1_autocorrelation: FloatArray
    iterations: int
    converged: bool = True

    @property
    def values(self) -> FloatArray:
        """β̂, shape (b,)."""
        return np.array([parameter.value for parameter in self.parameters])


@dataclass(frozen=True)
class ColumnCheck:
    """One regressor column in one gate: which column, how large, how likely, and whether it passed."""

    column: str
    size: float
    limit: float
    p_value: float | None
    passed: bool


@dataclass(frozen=True)
class Gate:
    """One gate of the revised DWH-test. ``passed`` is None where the gate was not reached."""

    name: GateName
    null: str
    passed: bool | None
    statistic: float | None
    distribution: str
    df: tuple[float, ...] | None
    p_value: float | None
    detail: str
    columns: tuple[ColumnCheck, ...] = ()


@dataclass(frozen=True)
class RevisedTest:
    """The revised DWH-test: three gates in order, a verdict, and what to do about it."""

    verdict: Verdict
    recommendation: str
    covariance: str
    gates: tuple[Gate, ...]


@dataclass(frozen=True)
class TorqueTrace:
    """Measured and predicted joint torque on the rows of the fit, for pictures."""

    time: FloatArray
    measured: FloatArray
    predicted: FloatArray


@dataclass(frozen=True)
class Identification:
    """Everything ``armhil identify`` reports of one arm on some captures."""

    robot: str
    rows: int
    least_squares: Estimate
    instrumental: Estimate | None
    instrumental_reason: str
    """Why there is no IV estimate; empty where there is one."""
    test: RevisedTest
    textbook: Gate | None
    trace: TorqueTrace
    warnings: tuple[str, ...] = ()

    @property
    def recommended(self) -> Estimate:
        """The estimate that the verdict tells to use; least squares where it tells to use none."""
        if self.test.verdict == "endogenous" and self.instrumental is not None:
            return self.instrumental
        return self.least_squares
