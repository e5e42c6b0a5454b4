"""What Prometheus scrapes: the last verdict, drift, missed cycles and the age of the baseline of each arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from prometheus_client import CollectorRegistry, Gauge, generate_latest

from daq.catalogue import checks, overview, runs
from daq.catalogue.database import Catalogue

VERDICTS = ("ok", "warning", "failed", "unknown")


def metrics_text(catalogue: Catalogue) -> bytes:
    """The metrics in Prometheus' text format."""
    registry = CollectorRegistry()

    def gauge(name: str, help_text: str, *labels: str) -> Gauge:
        return Gauge(f"armhil_{name}", help_text, ["arm", *labels], registry=registry)

    verdict = gauge("check_verdict", "1 for the verdict of the last check", "verdict")
    when = gauge("check_timestamp_seconds", "time of the last check, Unix time")
    share = gauge("torque_change_share", "rms torque of the change over the joint's rms torque", "joint")
    p_value = gauge("p_value", "of the Wald test with the run-to-run variation")
    missed = gauge("missed_cycles", "SYNC cycles that were missed in the last run")
    age = gauge("baseline_age_seconds", "since the baseline was accepted")
    unfinished = gauge("check_unfinished", "1 where the newest check has ended without a verdict")
    suspect = gauge("baseline_suspect", "1 where the baseline is doubted")
    runs.settle_abandoned(catalogue)
    now_known = overview.every(catalogue)
    figures = _figures_of(catalogue, [one.check.id for one in now_known if one.check is not None])
    for one in now_known:
        label, last, baseline = one.arm.label, one.check, one.baseline
        unfinished.labels(label).set(float(one.unfinished is not None))
        if last is not None:
            for word in VERDICTS:
                verdict.labels(label, word).set(float(last.verdict == word))
            when.labels(label).set(last.created.timestamp())
            known = figures[last.id]
            for joint, changed in enumerate(known.shares, start=1):
                share.labels(label, str(joint)).set(changed)
            if known.p_value is not None:
                p_value.labels(label).set(known.p_value)
        if one.run is not None and one.run.facts.get("missed_cycles") is not None:
            missed.labels(label).set(float(one.run.facts["missed_cycles"]))
        if baseline is not None:
            age.labels(label).set((datetime.now(tz=UTC) - baseline.accepted).total_seconds())
            suspect.labels(label).set(float(baseline.state == "suspect"))
    return generate_latest(registry)


@dataclass(frozen=True)
class Figures:
    """What of the details of a check is scraped."""

    shares: tuple[float, ...]
    p_value: float | None


_known: dict[str, dict[int, Figures]] = {}
"""Of the checks that were scraped last, by catalogue and number. Verdicts never change, details are long."""


def _figures_of(catalogue: Catalogue, numbers: Sequence[int]) -> dict[int, Figures]:
    """Of checks; those that are not known yet are read."""
    known = _known.get(str(catalogue.url), {})
    missing = [number for number in numbers if number not in known]
    read = {record.id: _figures(record.details) for record in checks.of_numbers(catalogue, missing)}
    found = {number: known.get(number) or read[number] for number in numbers}
    _known[str(catalogue.url)] = found
    return found


def _figures(details: Mapping[str, Any]) -> Figures:
    """Without what another version of armhil kept otherwise."""
    try:
        compared = details.get("comparison") or {}
        pairs = zip(compared.get("torque_change", ()), compared.get("torque_rms", ()), strict=False)
        shares = tuple(float(change / usual) if usual else 0.0 for change, usual in pairs)
        p_value = (compared.get("between_runs") or {}).get("p_value")
        return Figures(shares, None if p_value is None else float(p_value))
    except (AttributeError, TypeError, ValueError):
        return Figures((), None)
