"""`armhil rerun`."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, Quiet, RunNumber, console_of, print_json, steps_of


class Analysis(StrEnum):
    """What may be made of a recording."""

    IDENTIFICATION = "identification"
    DIAGNOSIS = "diagnosis"
    CHECK = "check"


@app.command()
def rerun(
    run: RunNumber,
    analysis: Annotated[
        Analysis | None,
        typer.Option(help="Which one.", show_default="identification; diagnosis where there is only that"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for report and model file; the model is kept too."),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Analyse again what a run recorded, with the settings of then: is it identical? Nothing ever moves.

    Example: [bold]armhil rerun 12[/]
    """
    from daq.catalogue import runs
    from daq.catalogue.database import Catalogue

    console = console_of(as_json)
    with Catalogue() as catalogue:
        runs.get(catalogue, run)
        from daq.keeping.rerun_choice import chosen_analysis

        wanted = Analysis(chosen_analysis(catalogue, run)) if analysis is None else analysis
        again = {
            Analysis.IDENTIFICATION: _identification,
            Analysis.DIAGNOSIS: _diagnosis,
            Analysis.CHECK: _check,
        }[wanted]
        return again(catalogue, run, steps_of(console, quiet), out, console, as_json)


def _identification(
    catalogue: Any, run: int, steps: Any, out: Path | None, console: Any, as_json: bool
) -> int:
    from daq.cli.catalogue_json import rerun_json
    from daq.cli.catalogue_terminal import print_rerun
    from daq.keeping.again import rerun as identify_again
    from daq.keeping.keep import keep_rerun

    result = identify_again(catalogue, run, steps, out)
    if result.result.report is not None:
        keep_rerun(catalogue, result)
    if as_json:
        print_json(rerun_json(result))
    print_rerun(console, result)
    return WARNING if result.sameness == "different" else OK


def _diagnosis(catalogue: Any, run: int, steps: Any, out: Path | None, console: Any, as_json: bool) -> int:
    from daq.cli.rerun_views import diagnosed_again_json, print_diagnosed_again
    from daq.keeping.diagnosed_again import diagnose_again
    from daq.keeping.keep import keep_diagnose_request

    result = diagnose_again(catalogue, run, steps, out)
    if out is not None:
        keep_diagnose_request(catalogue, result.request, result.result)
    if as_json:
        print_json(diagnosed_again_json(result))
    print_diagnosed_again(console, result)
    return WARNING if result.sameness == "different" else OK


def _check(catalogue: Any, run: int, steps: Any, out: Path | None, console: Any, as_json: bool) -> int:
    from daq.check.recheck import recheck
    from daq.cli.rerun_views import print_recheck, recheck_json

    result = recheck(catalogue, run, steps, out)
    if as_json:
        print_json(recheck_json(result))
    print_recheck(console, result)
    return WARNING if result.differs or result.again.sameness == "different" else OK
