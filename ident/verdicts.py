"""What the tests of an identification say: columns, gates, the revised DWH-test and its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["exogenous", "endogenous", "instruments_invalid", "not_testable"]
GateName = Literal["instruments", "rank", "exogeneity"]
ColumnKind = Literal["regressor", "torque", "following error"]
"""What is compared: a column of the regressor, the torque of a joint, the following error of a drive."""


@dataclass(frozen=True)
class ColumnCheck:
    """One regressor column in one gate: which column, how large, how likely, and whether it passed."""

    column: str
    size: float
    limit: float
    p_value: float | None
    passed: bool
    kind: ColumnKind = "regressor"


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
