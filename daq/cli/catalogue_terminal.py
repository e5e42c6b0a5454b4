"""The catalogue on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from daq.catalogue.details import RunDetails
from daq.catalogue.runs import UNJUDGED
from daq.catalogue.values import Model, Run
from daq.text.numbers import mixed_unit, percent, significant, with_sigma, with_units
from ident.effects.entry import found_words
from robots.standard import EITHER_UNIT

if TYPE_CHECKING:  # what makes them takes long to import
    from daq.keeping.again import Rerun, Sameness
    from daq.keeping.compare import Comparison
    from daq.keeping.prune import PrunePlan

_CAPTURE_WORDS = {
    "none": "none",
    "intact": "as it was recorded",
    "changed": "[red]another file is in its place[/]",
    "gone": "gone",
}
_VERDICTS = {
    "ok": "[green]ok[/]",
    "warning": "[yellow]warning[/]",
    "failed": "[red]failed[/]",
    "unknown": "unknown",
}
_NARROW = 100
"""Columns of a terminal below which the list of runs leaves out what there is no room for."""
_NOTABLE = 3.0
"""σ: from here on a difference is shown in colour."""


def print_runs(console: Console, runs: Sequence[Run], verdicts: Mapping[int, str]) -> None:
    """One line per run, newest first; ``verdicts`` are those of checks, by number of the run."""
    if not runs:
        console.print("No runs. `armhil demo` makes one.", highlight=False)
        return
    noted, narrow = any(run.note for run in runs), console.width < _NARROW
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    for heading in ("run", "started", "arm", "kind", "ended", *(("verdict",) if verdicts else ())):
        table.add_column(heading, no_wrap=True)
    # Where there is no room for both, the note says more to whoever wrote it; `show` has everything.
    texts = (["trajectory"] if not (noted and narrow) else []) + (["note"] if noted else [])
    for heading in texts:
        table.add_column(heading)
    for run in runs:
        cells = {"trajectory": escape(run.trajectory), "note": escape(run.note.partition("\n")[0])}
        judged = (_VERDICTS.get(verdicts.get(run.id, ""), ""),) if verdicts else ()
        table.add_row(*_run_cells(run, narrow), *judged, *(cells[text] for text in texts))
    console.print(table)


def _run_cells(run: Run, narrow: bool) -> tuple[str, ...]:
    return (
        str(run.id),
        _local(run.started)[5 if narrow else 0 : 16],
        escape(run.arm),
        f"{run.kind} {run.stage}".strip(),
        _ending(run),
    )


def print_details(console: Console, details: RunDetails) -> None:
    """Everything of one run."""
    run = details.run
    lines = {
        "Run": f"{run.id}: {f'{run.kind} {run.stage}'.strip()} of {escape(run.arm)} by {escape(run.who)}",
        "Started": f"{_local(run.started)}{_lasting(run)}",
        "Ended": _ending(run) + (f": {escape(run.reason)}" if run.reason else ""),
        "Trajectory": escape(run.trajectory),
        "Capture": f"{escape(run.capture or '')} ({_CAPTURE_WORDS[details.capture]})".strip(),
        "SHA-256": run.capture_sha256 or "",
        "Description": f"{run.description_sha256[:16]}…",
        **{
            key.replace("_", " ").capitalize(): escape(str(value))
            for key, value in run.facts.items()
            if key != "description"
        },
        "Note": escape(run.note),
    }
    for name, text in lines.items():
        if text:
            console.print(f"[bold]{name:<18}[/]{text}", soft_wrap=True, highlight=False)
    for model in details.models:
        console.print(_model_line(model), soft_wrap=True, highlight=False)
    unit = mixed_unit(details.models[-1].torque_units) if details.models else EITHER_UNIT
    for finding in details.findings:
        gap = f"{significant(finding.gap_before or 0)} → {significant(finding.gap_after or 0)} {unit}"
        console.print(f"[bold]Finding[/]  {escape(finding.sentence)}; gap {gap}", highlight=False)
    for check in details.checks:
        console.print(f"[bold]Check[/]  {check.verdict}: {escape(check.sentence)}", highlight=False)
    for baseline in details.baselines:
        event = baseline.events[-1]
        words = f"{event.state.replace('_', ' ')} by {escape(event.author)}: {escape(event.reason)}"
        console.print(f"[bold]Baseline[/]  {baseline.id}: {words}", highlight=False)


def print_rerun(console: Console, rerun: Rerun) -> None:
    """Whether the results are those of then."""
    estimate = rerun.result.fitted.result.recommended
    console.print(
        f"Run {rerun.run.id}: {rerun.result.fitted.result.test.verdict},"
        f" relative torque error {percent(estimate.relative_error_percent)}",
        highlight=False,
    )
    print_sameness(console, rerun.sameness, rerun.largest, rerun.largest_name, rerun.remarks)
    if rerun.result.report is not None:
        console.print(f"Report: [bold]{escape(str(rerun.result.report))}[/]", soft_wrap=True, highlight=False)


def print_sameness(
    console: Console, sameness: Sameness, largest: float | None, name: str, remarks: Sequence[str]
) -> None:
    """How far two results agree, and what is not as it was then."""
    away = "" if largest is None else f"; largest difference {significant(largest)} σ ({name})"
    words = {
        "identical": "[green]IDENTICAL[/]: every bit of the parameters and their covariance is as it was",
        "rounding": f"[green]THE SAME[/] but for rounding{away}",
        "different": f"[yellow]DIFFERENT[/]{away}",
        "first": "This is the first identification of this run; there is nothing to compare it with",
    }
    console.print(f"[bold]{words[sameness]}[/]", highlight=False)
    for remark in remarks:
        console.print(f"  {escape(remark)}", highlight=False)


def print_comparison(console: Console, comparison: Comparison) -> None:
    """Parameters side by side, then torque."""
    first, second = comparison.runs
    table = Table(box=SIMPLE_HEAD, padding=(0, 1))
    for heading in ("parameter", "unit"):
        table.add_column(heading, no_wrap=True)
    for heading in (f"run {first.id}", "σ", f"run {second.id}", "σ", "in σ"):
        table.add_column(heading, justify="right", no_wrap=True)
    for p in comparison.parameters:
        value, sigma = with_sigma(p.first.value, p.first.sigma)
        other, other_sigma = with_sigma(p.second.value, p.second.sigma)
        away = "" if p.sigmas is None else f"{p.sigmas:+.1f}".replace("-", "−")
        colour = p.sigmas is not None and abs(p.sigmas) > _NOTABLE
        table.add_row(
            p.name,
            p.unit,
            value,
            sigma,
            other,
            other_sigma,
            f"[yellow]{away}[/]" if colour else away,
        )
    console.print(table)
    for number, names in ((first.id, comparison.only_first), (second.id, comparison.only_second)):
        if names:
            console.print(f"Only in run {number}: {', '.join(names)}", highlight=False)
    for run, model in zip(comparison.runs, comparison.models, strict=True):
        rms = with_units([significant(value) for value in model.torque_rms], model.torque_units)
        error = percent(model.relative_error_percent)
        console.print(
            f"Run {run.id}: {model.verdict}, torque error {error}, rms per joint {rms}", highlight=False
        )
    if comparison.torque is None:
        console.print(f"Torque between them: {escape(comparison.torque_reason)}", highlight=False)
    else:
        units = comparison.models[0].torque_units
        between = zip(comparison.torque.rms, units, comparison.torque.share_percent, strict=True)
        words = "  ".join(f"{significant(float(r))} {unit} ({percent(float(s))})" for r, unit, s in between)
        console.print(
            f"Torque between them on the motion of run {first.id}, rms per joint: {words}",
            highlight=False,
        )
    for remark in comparison.remarks:
        console.print(f"[yellow]note:[/] {escape(remark)}", highlight=False)


def print_prune(console: Console, plan: PrunePlan, heading: str) -> None:
    """What goes and what stays."""
    for kept in plan.kept:
        console.print(f"keeps   run {kept.run.id}: {escape(kept.reason)}", highlight=False)
    for entry in plan.prunable:
        line = f"{heading} run {entry.run.id}: {escape(str(entry.path))} ({_megabytes(entry.size)})"
        console.print(line, soft_wrap=True, highlight=False)
    total = sum(entry.size for entry in plan.prunable)
    console.print(f"{len(plan.prunable)} recordings, {_megabytes(total)}", highlight=False)


def _model_line(model: Model) -> str:
    error = percent(model.relative_error_percent)
    where = "" if model.report is None else f"; {escape(model.report)}"
    found = f", with {found_words(model.found)}" if model.found else ""
    return (
        f"[bold]Model {model.id:<12}[/]{model.verdict} ({model.method}), torque error {error},"
        f" {len(model.parameters)} parameters{found}{where}"
    )


def _ending(run: Run) -> str:
    if run.state == "running":
        return "[cyan]running[/]"
    if run.state == "abandoned":
        return "[yellow]abandoned[/]"
    if run.reason == UNJUDGED:
        return "[yellow]no verdict[/]"
    return run.outcome if run.outcome == "completed" else f"[yellow]{run.outcome}[/]"


def _lasting(run: Run) -> str:
    if run.finished is None:
        return ""
    return f", {(run.finished - run.started).total_seconds():.0f} s"


def _local(time: datetime) -> str:
    return time.astimezone().strftime("%Y-%m-%d %H:%M:%S")


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
