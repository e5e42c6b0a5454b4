"""`armhil diagnose`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from daq.cli.app import app
from daq.cli.common import (
    OK,
    WARNING,
    Columns,
    Json,
    NoCatalogue,
    RobotOfRecording,
    bus_of,
    catalogue_of,
    console_of,
    print_json,
)


@app.command()
def diagnose(
    paths: Annotated[
        list[Path] | None, typer.Argument(help="Captures or logs to find the missing effect on.")
    ] = None,
    validate: Annotated[
        list[Path] | None, typer.Option("--validate", help="Captures or logs to show the gap on.")
    ] = None,
    robot: RobotOfRecording = None,
    columns: Columns = None,
    split_half: Annotated[
        bool, typer.Option("--split-half", help="Validate on the second half of each record.")
    ] = False,
    without: Annotated[
        list[str] | None, typer.Option("--without", help="An effect to leave out of the model.")
    ] = None,
    prior: Annotated[
        str | None, typer.Option(help="An accepted model file, or cad.", show_default="after a refit")
    ] = None,
    cell: Annotated[
        Path | None, typer.Option(help="cell.toml: what a planned motion has to keep clear of.")
    ] = None,
    live: Annotated[
        str | None, typer.Option("--live", help="The arm on its bench: record, and settle what is ambiguous.")
    ] = None,
    interface: Annotated[
        str | None, typer.Option(help="python-can interface, with --live.", show_default="the robot's")
    ] = None,
    channel: Annotated[
        str | None, typer.Option(help="Channel on it, with --live.", show_default="the robot's")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Allow the motions of --live without asking.")] = False,
    rounds: Annotated[int, typer.Option(min=0, help="Motions of --live to tell candidates apart.")] = 2,
    duration: Annotated[
        float, typer.Option(min=2.0, max=120.0, help="One period of what --live records first, s.")
    ] = 12.0,
    evaluations: Annotated[
        int, typer.Option(min=0, help="Trials of the search for a motion; 0 plans none.")
    ] = 1500,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for page, result and model file.")] = None,
    no_catalogue: NoCatalogue = False,
    as_json: Json = False,
) -> int:
    """Find what the model lacks, name it, add it, and show the gap shrink on data that was not fitted.

    Example: [bold]armhil diagnose runs/a/capture.mcap --validate runs/b/capture.mcap --out runs/why[/]
    """
    from daq.catalogue.keep import keep_diagnose_request
    from daq.diagnosis.diagnose import DiagnoseRequest, run_diagnose
    from daq.diagnosis.diagnosis_terminal import print_diagnosis
    from daq.identification.terminal import TerminalSteps
    from daq.recording.capture import CaptureError

    console = console_of(as_json)
    request = DiagnoseRequest(
        tuple(paths or ()),
        tuple(validate or ()),
        robot if live is None else live,
        columns,
        split_half,
        tuple(without or ()),
        prior,
        out,
        cell,
        evaluations,
    )
    catalogue = catalogue_of(no_catalogue or (out is None and live is None))
    if live is None:
        if not paths:
            raise CaptureError("no recording; allowed: captures or logs, or --live with the arm on its bench")
        result = run_diagnose(request, TerminalSteps(console))
        content = result.content
    else:
        result, content, request = _live(request, live, (interface, channel), yes, rounds, duration, console)
    if catalogue is not None:
        keep_diagnose_request(catalogue, request, result)
    if as_json:
        print_json(content)
    print_diagnosis(console, result.diagnosis, result.series.checks, result.apart, result.blind)
    if result.folder is not None:
        page = result.folder / "diagnosis.html"
        console.print(f"\nPage: [bold]{page}[/]", soft_wrap=True, highlight=False)
    return OK if result.diagnosis.verdict == "clean" else WARNING


def _live(
    request: Any,
    source: str,
    bus: tuple[str | None, str | None],
    yes: bool,
    rounds: int,
    duration: float,
    console: Any,
) -> tuple[Any, dict[str, Any], Any]:
    """The last diagnosis with the arm in the loop, what ``--json`` prints of it, and what it was made of."""
    import robots
    from daq.diagnosis.bench import stream_and_record
    from daq.diagnosis.diagnose import conditions_of
    from daq.diagnosis.live import LiveRequest, live_folder, run_live
    from daq.identification.terminal import TerminalSteps
    from daq.session.keyboard import by_keyboard

    arm, steps = robots.load(source), TerminalSteps(console)
    channel, conditions = bus_of(arm, *bus), conditions_of(request.cell)
    live = LiveRequest(request, arm, live_folder(request.out, arm), rounds=rounds, duration=duration)
    found = run_live(
        live,
        lambda trajectory, path: stream_and_record(
            arm, channel, trajectory, conditions, path, steps, by_keyboard
        ),
        lambda question: yes or _asked(question),
        steps,
    )
    if found.refused:
        console.print(f"No motion without leave ({found.refused}); --yes allows it", highlight=False)
    more = {
        "recorded": [str(path) for path in found.recorded],
        "rounds": len(found.results) - 1,
        "refused": found.refused or None,
    }
    return found.last, found.last.content | {"live": more}, found.request


def _asked(question: str) -> bool:
    """Whether somebody who sits at the terminal says yes; where nobody does, the answer is no."""
    return sys.stdin.isatty() and typer.confirm(f"{question}. Move it?", default=False, err=True)
