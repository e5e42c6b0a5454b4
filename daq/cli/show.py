"""`armhil show`."""

from __future__ import annotations

from daq.cli.app import app
from daq.cli.common import Json, RunNumber, console_of, print_json


@app.command()
def show(run: RunNumber, as_json: Json = False) -> None:
    """Show everything that the catalogue knows of a run.

    Example: [bold]armhil show 12[/]
    """
    from daq.catalogue.database import Catalogue
    from daq.catalogue.details import details
    from daq.catalogue.runs import settle_abandoned
    from daq.cli.catalogue_json import details_json
    from daq.cli.catalogue_terminal import print_details

    with Catalogue() as catalogue:
        settle_abandoned(catalogue)
        found = details(catalogue, run)
    if as_json:
        print_json(details_json(found))
    print_details(console_of(as_json), found)
