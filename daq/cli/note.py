"""`armhil note`."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import Json, RunNumber, console_of, print_json


@app.command()
def note(
    run: RunNumber,
    text: Annotated[str, typer.Argument(help="What is to be remembered of the run.")],
    as_json: Json = False,
) -> None:
    """Add a line to the note of a run.

    Example: [bold]armhil note 12 "cover of joint 3 was off"[/]
    """
    from daq.catalogue import runs
    from daq.catalogue.database import Catalogue
    from daq.catalogue.details import details
    from daq.cli.catalogue_json import details_json

    with Catalogue() as catalogue:
        runs.note(catalogue, run, text)
        noted = details(catalogue, run)
    if as_json:
        print_json(details_json(noted))
    console_of(as_json).print(f"Run {run}: {noted.run.note}", highlight=False, markup=False, soft_wrap=True)
