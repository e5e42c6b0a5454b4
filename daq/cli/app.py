"""The command `armhil` itself, with the options of every command."""

from __future__ import annotations

import importlib.metadata
import logging
import sys
from typing import Annotated

import typer

app = typer.Typer(
    name="armhil",
    help="Identify the dynamic model of a robot arm over CAN, and say whether the model can be trusted.",
    epilog="Example: [bold]armhil demo[/]",
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"armhil {importlib.metadata.version('armhil')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log what is done to stderr.")] = False,
) -> None:
    """Options of every command."""
    logging.basicConfig(
        level=logging.INFO if verbose else logging.ERROR,
        format="%(levelname)s %(name)s: %(message)s",
        stream=sys.stderr,
    )
    if not verbose:
        # What goes wrong on the bus is told by the exception that comes of it, in one line.
        for library in ("can", "canopen"):
            logging.getLogger(library).setLevel(logging.CRITICAL)
