"""The report of a check: its verdict first, then the identification that it rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from daq.catalogue.values import Baseline, CheckRecord
from daq.identification.results import report_content
from daq.report.check_view import CheckView, check_view
from daq.report.page import write_report
from ident import Fitted, Recording
from robots import Robot


def write_check_report(
    path: Path,
    robot: Robot,
    fitted: Fitted,
    recordings: Sequence[Recording],
    title: str,
    facts: Mapping[str, str],
    record: CheckRecord,
    baseline: Baseline | None,
) -> None:
    """Write the page in the place of the identification's.

    Args:
        path: of the page.
        robot: the arm.
        fitted: tonight's identification.
        recordings: that it was made from.
        title: of the page.
        facts: how the data was made, label → text.
        record: the verdict, as it was kept.
        baseline: that it was compared with; None where there is none.

    Raises:
        ReportError: the file cannot be written.
    """
    view = view_of(record, baseline)
    write_report(path, report_content(robot, fitted, recordings, title=title, facts=facts, check=view))


def view_of(record: CheckRecord, baseline: Baseline | None) -> CheckView:
    """A check of the catalogue as a page shows it."""
    known = ("", "`armhil baseline accept RUN` makes one")
    if baseline is not None:
        doubt = " (SUSPECT)" if baseline.state == "suspect" else ""
        accepted = f"accepted {baseline.accepted:%Y-%m-%d} by {baseline.events[0].author}"
        known = (f"run {baseline.run_id}{doubt}", accepted)
    tonight = (f"run {record.run_id}", f"{record.created:%Y-%m-%d %H:%M} UTC")
    return check_view(record.verdict, record.sentence, record.details, known, tonight)
