"""`armhil rerun`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, RunNumber, console_of, print_json


@app.command()
def rerun(
    run: RunNumber,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for report and model file; the model is kept too."),
    ] = None,
    as_json: Json = False,
) -> int:
    """Identify again what a run recorded, with the settings of then; says whether the results are identical.

    Example: [bold]armhil rerun 12[/]
    """
    from daq.catalogue.again import rerun as identify_again
    from daq.catalogue.catalogue_json import rerun_json
    from daq.catalogue.database import Catalogue
    from daq.catalogue.keep import keep_rerun
    from daq.catalogue.terminal import print_rerun
    from daq.identification.terminal import TerminalSteps

    console = console_of(as_json)
    with Catalogue() as catalogue:
        result = identify_again(catalogue, run, TerminalSteps(console), out)
        if result.result.report is not None:
            keep_rerun(catalogue, result)
    if as_json:
        print_json(rerun_json(result))
    print_rerun(console, result)
    return WARNING if result.sameness == "different" else OK
