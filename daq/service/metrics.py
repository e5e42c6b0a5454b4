"""What Prometheus scrapes: the last verdict, drift, missed cycles and the age of the baseline of each arm."""

from __future__ import annotations

from datetime import UTC, datetime

from prometheus_client import CollectorRegistry, Gauge, generate_latest

from daq.catalogue import arms, baselines, checks, runs
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
    for arm in arms.every(catalogue):
        last = checks.of_arm(catalogue, arm.id, limit=1)
        judged = last[0].run_id if last else 0
        unfinished.labels(arm.label).set(float(runs.unfinished_check(catalogue, arm, judged) is not None))
        if last:
            for word in VERDICTS:
                verdict.labels(arm.label, word).set(float(last[0].verdict == word))
            when.labels(arm.label).set(last[0].created.timestamp())
            compared = last[0].details.get("comparison") or {}
            pairs = zip(compared.get("torque_change", ()), compared.get("torque_rms", ()), strict=False)
            for joint, (change, usual) in enumerate(pairs, start=1):
                share.labels(arm.label, str(joint)).set(change / usual if usual else 0.0)
            between = compared.get("between_runs")
            if between and between.get("p_value") is not None:
                p_value.labels(arm.label).set(between["p_value"])
        done = runs.every(catalogue, arm=arm.label, limit=1)
        if done and done[0].facts.get("missed_cycles") is not None:
            missed.labels(arm.label).set(float(done[0].facts["missed_cycles"]))
        baseline = baselines.current(catalogue, arm.id)
        if baseline is not None:
            age.labels(arm.label).set((datetime.now(tz=UTC) - baseline.accepted).total_seconds())
            suspect.labels(arm.label).set(float(baseline.state == "suspect"))
    return generate_latest(registry)
