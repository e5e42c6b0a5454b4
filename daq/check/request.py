"""What a check is asked for, and what it gives back."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from daq.catalogue.database import Catalogue
from daq.catalogue.values import Baseline
from daq.session.bench import ArmOrder
from daq.session.cell import Cell
from ident import Fitted
from ident.drift import Comparison, DriftSettings


class Verdict(StrEnum):
    """The verdict of a check; its exit code is that of a Nagios plugin."""

    OK = "ok"
    WARNING = "warning"
    FAILED = "failed"
    UNKNOWN = "unknown"

    @property
    def exit_code(self) -> int:
        """0 fine, 1 warning or a drift within limits, 2 failed, 3 not measurable."""
        return {"ok": 0, "warning": 1, "failed": 2, "unknown": 3}[self]


@dataclass(frozen=True)
class CheckRequest:
    """What to check.

    Attributes:
        arm: which arm, where.
        folder: for recording, report and model; exists and is writable.
        catalogue: where baselines are and verdicts go.
        trajectory: to drive; the accepted one where None, a planned one where there is none.
        duration, evaluations: of a plan.
        celsius: temperature of the hall; what the drives report where None.
        search: look for a missing effect where something moved and nothing known explains it.
        settings: false alarms allowed, tolerance.
        cell: what approach and trajectory have to keep clear of.
    """

    arm: ArmOrder
    folder: Path
    catalogue: Catalogue
    trajectory: Path | None = None
    duration: float = 12.0
    evaluations: int = 6000
    celsius: float | None = None
    search: bool = False
    settings: DriftSettings = field(default_factory=DriftSettings)
    cell: Cell = field(default_factory=Cell)


@dataclass(frozen=True)
class CheckResult:
    """What came out.

    Attributes:
        arm: label of the arm.
        verdict, sentence: for an operator.
        warnings: what the verdict should be read with, loud.
        run, model, check: numbers in the catalogue.
        baseline: that it was compared with; None where there is none.
        comparison: None where there is no baseline.
        fitted: the identification.
        capture, report: files.
        findings: sentences of the search for missing effects.
        previous: verdict of the check before; empty where there was none.
        tolerance: share of a joint's torque by which it may change.
    """

    arm: str
    verdict: Verdict
    sentence: str
    warnings: tuple[str, ...]
    run: int
    model: int
    check: int
    baseline: Baseline | None
    comparison: Comparison | None
    fitted: Fitted
    capture: Path
    report: Path
    findings: tuple[str, ...] = ()
    previous: str = ""
    tolerance: float = DriftSettings.tolerance
