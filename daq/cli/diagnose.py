"""`armhil diagnose`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, NoCatalogue, catalogue_of, console_of, print_json


@app.command()
def diagnose(
    paths: Annotated[list[Path], typer.Argument(help="Captures or logs to find the missing effect on.")],
    validate: Annotated[
        list[Path] | None, typer.Option("--validate", help="Captures or logs to show the gap on.")
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option("--robot", help="A shipped arm or a robot.toml.", show_default="the capture's own"),
    ] = None,
    columns: Annotated[
        Path | None, typer.Option(help="Column map of a log.", show_default="the robot's")
    ] = None,
    split_half: Annotated[
        bool, typer.Option("--split-half", help="Validate on the second half of each record.")
    ] = False,
    without: Annotated[
        list[str] | None, typer.Option("--without", help="An effect to leave out of the model.")
    ] = None,
    prior: Annotated[
        str | None, typer.Option(help="An accepted model file, or cad.", show_default="after a refit")
    ] = None,
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

    console = console_of(as_json)
    fit, held = tuple(paths), tuple(validate or ())
    request = DiagnoseRequest(fit, held, robot, columns, split_half, tuple(without or ()), prior, out)
    catalogue = catalogue_of(no_catalogue or out is None)
    result = run_diagnose(request, TerminalSteps(console))
    if catalogue is not None:
        keep_diagnose_request(catalogue, request, result)
    if as_json:
        print_json(result.content)
    print_diagnosis(console, result.diagnosis, result.series.checks, result.apart)
    if result.folder is not None:
        page = result.folder / "diagnosis.html"
        console.print(f"\nPage: [bold]{page}[/]", soft_wrap=True, highlight=False)
    return OK if result.diagnosis.verdict == "clean" else WARNING
