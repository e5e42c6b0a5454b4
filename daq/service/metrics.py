"""What Prometheus scrapes: the last verdict, drift, missed cycles and the age of the baseline of each arm."""

from __future__ import annotations

from datetime import UTC, datetime

from prometheus_client import CollectorRegistry, Gauge, generate_latest

from daq.catalogue import overview, runs
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
    for one in overview.every(catalogue):
        label, last, baseline = one.arm.label, one.check, one.baseline
        unfinished.labels(label).set(float(one.unfinished is not None))
        if last is not None:
            for word in VERDICTS:
                verdict.labels(label, word).set(float(last.verdict == word))
            when.labels(label).set(last.created.timestamp())
            compared = last.details.get("comparison") or {}
            pairs = zip(compared.get("torque_change", ()), compared.get("torque_rms", ()), strict=False)
            for joint, (change, usual) in enumerate(pairs, start=1):
                share.labels(label, str(joint)).set(change / usual if usual else 0.0)
            between = compared.get("between_runs")
            if between and between.get("p_value") is not None:
                p_value.labels(label).set(between["p_value"])
        if one.run is not None and one.run.facts.get("missed_cycles") is not None:
            missed.labels(label).set(float(one.run.facts["missed_cycles"]))
        if baseline is not None:
            age.labels(label).set((datetime.now(tz=UTC) - baseline.accepted).total_seconds())
            suspect.labels(label).set(float(baseline.state == "suspect"))
    return generate_latest(registry)
