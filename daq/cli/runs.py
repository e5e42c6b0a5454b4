"""`armhil runs`."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import Json, OfArm, console_of, print_json


@app.command()
def runs(
    arm: OfArm = None,
    kind: Annotated[
        str | None,
        typer.Option(help="demo, plan, check, commission, import or run.", show_default="all"),
    ] = None,
    limit: Annotated[int, typer.Option(min=1, help="At most so many, the newest.")] = 20,
    as_json: Json = False,
) -> None:
    """List the runs in the catalogue, newest first.

    Example: [bold]armhil runs --limit 5[/]
    """
    from daq.catalogue import arms, checks
    from daq.catalogue import runs as catalogued
    from daq.catalogue.database import Catalogue
    from daq.cli.catalogue_json import runs_json
    from daq.cli.catalogue_terminal import print_runs

    with Catalogue() as catalogue:
        catalogued.settle_abandoned(catalogue)
        if arm is not None:
            arms.by_label(catalogue, arm)
        found = catalogued.every(catalogue, arm=arm, kind=catalogued.kind_of(kind), limit=limit)
        verdicts = checks.verdicts_of(catalogue, [run.id for run in found])
    if as_json:
        print_json(runs_json(found, verdicts))
    print_runs(console_of(as_json), found, verdicts)
