"""`armhil compare`."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import Json, console_of, print_json


@app.command()
def compare(
    first: Annotated[int, typer.Argument(help="Number of a run.", metavar="RUN")],
    second: Annotated[int, typer.Argument(help="Number of the other.", metavar="RUN")],
    as_json: Json = False,
) -> None:
    """Compare the models of two runs: parameters with σ, differences in σ, and what that is in torque.

    Example: [bold]armhil compare 11 12[/]
    """
    from daq.catalogue import runs
    from daq.catalogue.database import Catalogue
    from daq.cli.catalogue_json import comparison_json
    from daq.cli.catalogue_terminal import print_comparison

    with Catalogue() as catalogue:
        for run in (first, second):
            runs.get(catalogue, run)
        from daq.keeping.compare import compare as compared

        found = compared(catalogue, first, second)
    if as_json:
        print_json(comparison_json(found))
    print_comparison(console_of(as_json), found)
