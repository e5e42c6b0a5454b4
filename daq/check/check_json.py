"""What ``armhil check --json`` and ``armhil baseline --json`` print (docs/reference/json.md)."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

from daq.check.baseline import baseline_json
from daq.check.judged import comparison_json
from daq.check.request import CheckResult
from ident.drift import Course


def check_json(result: CheckResult) -> dict[str, Any]:
    """One check."""
    return {
        "armhil": version("armhil"),
        "arm": result.arm,
        "verdict": result.verdict.value,
        "exit_code": result.verdict.exit_code,
        "previous_verdict": result.previous or None,
        "sentence": result.sentence,
        "warnings": list(result.warnings),
        "run": result.run,
        "model": result.model,
        "check": result.check,
        "baseline": None if result.baseline is None else baseline_json(result.baseline),
        "test": result.fitted.result.test.verdict,
        "comparison": None if result.comparison is None else comparison_json(result.comparison),
        "findings": list(result.findings),
        "capture": str(result.capture),
        "report": str(result.report),
    }


def performance_data(result: CheckResult) -> str:
    """Nagios performance data (Monitoring Plugins' guidelines, 2.6): ``label=value;warn;crit;min;max``.

    Change of the torque per joint in N·m, critical beyond the tolerance; how much of what is forgiven the
    chart that says most has used, a warning beyond 1; and the p-value of tonight.
    """
    compared = result.comparison
    if compared is None:
        return ""
    limits = result.tolerance * compared.torque_rms
    pairs = enumerate(zip(compared.torque_change, limits, strict=True), start=1)
    parts = [f"'torque_change_{joint}'={value:.4g};;{limit:.4g};0" for joint, (value, limit) in pairs]
    used = _used(compared.course)
    if used is not None:
        parts.append(f"'forgiven_used'={used:.3g};1;;0")
    if compared.between_runs is not None:
        parts.append(f"'p_value'={compared.between_runs.p_value:.3g};;;0;1")
    return " ".join(parts)


def _used(course: Course | None) -> float | None:
    """Tonight's distance from what was expected, over the distance that would have been fine."""
    if course is None or not course.high > course.low:
        return None
    expected, allowed = (course.low + course.high) / 2, (course.high - course.low) / 2
    return abs(float(course.amount[-1]) - expected) / allowed
