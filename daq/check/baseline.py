"""Baselines as an operator handles them: by run and by an arm's label, with author, reason and report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from daq.catalogue import arms, baselines, models
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Baseline
from daq.check.errors import CheckError
from daq.recording.who import user

Changed = tuple[str, tuple[Baseline, ...]]
"""Label of the arm and all its baselines, newest first."""


def accept_run(
    catalogue: Catalogue, run_id: int, author: str | None, reason: str, report: Path | None
) -> Changed:
    """The newest model of a run becomes the baseline of its arm.

    Raises:
        CatalogueError: there is no such run, or it has no model.
        CheckError: no reason, a report that is not there, or a model without a covariance to compare with.
    """
    model = models.latest_of(catalogue, run_id)
    if model.covariance is None:
        raise CheckError(f"run {run_id}: its model has no covariance, so nothing can be compared with it")
    page = _report(report) or model.report
    baselines.accept(catalogue, model.id, author or user(), _reason(reason), page)
    return _all(catalogue, model.arm_id)


def roll_back(
    catalogue: Catalogue, label: str, author: str | None, reason: str, report: Path | None
) -> Changed:
    """The baseline is taken back.

    Raises:
        CatalogueError: there is no such arm, or it has no baseline.
        CheckError: no reason, or a report that is not there.
    """
    arm = arms.by_label(catalogue, label)
    baselines.roll_back(catalogue, arm.id, author or user(), _reason(reason), _report(report))
    return _all(catalogue, arm.id)


def suspect_arm(
    catalogue: Catalogue, label: str, author: str | None, reason: str, report: Path | None
) -> Changed:
    """The baseline is doubted. Raises as :func:`roll_back`."""
    arm = arms.by_label(catalogue, label)
    baselines.suspect(catalogue, arm.id, author or user(), _reason(reason), _report(report))
    return _all(catalogue, arm.id)


def trust_arm(
    catalogue: Catalogue, label: str, author: str | None, reason: str, report: Path | None
) -> Changed:
    """The baseline is doubted no longer. Raises as :func:`roll_back`."""
    arm = arms.by_label(catalogue, label)
    baselines.trust(catalogue, arm.id, author or user(), _reason(reason), _report(report))
    return _all(catalogue, arm.id)


def all_of(catalogue: Catalogue, label: str) -> tuple[Baseline, ...]:
    """All baselines of an arm, newest first.

    Raises:
        CatalogueError: there is no such arm.
    """
    return baselines.of_arm(catalogue, arms.by_label(catalogue, label).id)


def print_baselines(console: Console, label: str, found: tuple[Baseline, ...]) -> None:
    """Newest first, each with what was said of it."""
    if not found:
        console.print(f"Arm {escape(label)} has no baseline; `armhil baseline accept RUN` makes one.")
    counts = next((one.id for one in found if one.state != "rolled_back"), None)
    for one in found:
        mark = " [bold](counts)[/]" if one.id == counts else ""
        state = one.state.replace("_", " ")
        console.print(
            f"Baseline {one.id} of {escape(label)}: run {one.run_id}, {state}{mark}", highlight=False
        )
        for event in one.events:
            page = f", {event.report}" if event.report else ""
            what = f"{event.state.replace('_', ' ')} by {event.author}: {event.reason}{page}"
            said = f"  {event.at:%Y-%m-%d %H:%M} UTC {what}"
            console.print(escape(said), soft_wrap=True, highlight=False)


def baseline_json(baseline: Baseline) -> dict[str, Any]:
    """One baseline with everything that was said of it."""
    return {
        "id": baseline.id,
        "run": baseline.run_id,
        "model": baseline.model_id,
        "state": baseline.state,
        "accepted": baseline.accepted.isoformat(),
        "description_sha256": baseline.description_sha256,
        "events": [
            {
                "state": event.state,
                "author": event.author,
                "reason": event.reason,
                "report": event.report,
                "at": event.at.isoformat(),
            }
            for event in baseline.events
        ],
    }


def _all(catalogue: Catalogue, arm_id: int) -> Changed:
    return arms.get(catalogue, arm_id).label, baselines.of_arm(catalogue, arm_id)


def _reason(text: str) -> str:
    if not text.strip():
        raise CheckError("--reason is empty; say why, it is kept for ever")
    return text.strip()


def _report(path: Path | None) -> str | None:
    if path is None:
        return None
    if not path.is_file():
        raise CheckError(f"--report {path}: there is no such file")
    return str(path.absolute())
