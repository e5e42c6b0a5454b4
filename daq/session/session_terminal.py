"""Commissioning on the terminal."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from daq.catalogue.kept_run import trajectory_words
from daq.session.commission import StageDone
from daq.session.dry_run import CommissionRequest, Planned
from daq.session.stages import MOVING, PURPOSES, StageStatus

_STATES = {"passed": "[green]passed[/]", "open": "[bold]open[/]", "locked": "[dim]locked[/]"}


def print_planned(
    console: Console, planned: Planned, request: CommissionRequest, onward: Sequence[str] | None
) -> None:
    """The stages, what each takes, and how to go on.

    Args:
        console: of the terminal.
        planned, request: what would be done.
        onward: words of the command that moves the arm, but for its motion; None where it moves now.
    """
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    for heading in ("stage", "", "what happens", "takes"):
        table.add_column(heading, no_wrap=heading != "what happens")
    for status in planned.states:
        table.add_row(status.name, _state(status), PURPOSES[status.name], _takes(planned, status))
    console.print(table)
    words = trajectory_words(planned.trajectory)
    console.print(f"Trajectory: {words}, {escape(str(planned.file))}", soft_wrap=True, highlight=False)
    around = request.cell.words or "nothing but the arm itself; --cell CELL.toml says what stands around it"
    console.print(f"Keeps clear of: {escape(around)}", soft_wrap=True, highlight=False)
    if onward is not None:
        command = shlex.join([*onward, "--trajectory", str(planned.file), "--move"])
        console.print(
            f"Dry run: nothing was sent and nothing moved. To go on:\n  [bold]{escape(command)}[/]",
            soft_wrap=True,
            highlight=False,
        )


def print_done(console: Console, done: Sequence[StageDone]) -> None:
    """What was gone through."""
    if not done:
        console.print("Every stage has passed; --from begins with one of them again.", highlight=False)
    for stage in done:
        run = "" if stage.run is None else f" (run {stage.run})"
        where = "" if stage.capture is None else f": {stage.capture}"
        console.print(
            f"[green]passed[/] {stage.name}{run}, {escape(stage.words)}{escape(where)}",
            soft_wrap=True,
            highlight=False,
        )
    full = [stage.capture for stage in done if stage.name == "full run"]
    if full:
        console.print(
            f"Next: [bold]armhil identify {escape(str(full[-1]))}[/]", soft_wrap=True, highlight=False
        )


def _state(status: StageStatus) -> str:
    return _STATES[status.state] + ("" if status.run is None else f" (run {status.run.id})")


def _takes(planned: Planned, status: StageStatus) -> str:
    if status.name in planned.estimates:
        return planned.estimates[status.name].words()
    return "by where it stands" if status.name in MOVING else "–"
