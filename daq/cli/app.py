"""The command `armhil` itself, with the options of every command."""

from __future__ import annotations

import importlib.metadata
import logging
import os
import shlex
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

SAID = "armhil.said"
"""Logger of what the command line tells people: its call, its warnings, how it ended."""

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
    log: Annotated[
        Path | None,
        typer.Option("--log", help="Log what is done and said to this file.", show_default="none"),
    ] = None,
) -> None:
    """Options of every command."""
    told = logging.StreamHandler(sys.stderr)
    told.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))
    told.setLevel(logging.INFO if verbose else logging.ERROR)
    told.addFilter(lambda record: record.name != SAID)  # it is on stderr already
    logging.basicConfig(
        level=logging.INFO, handlers=[told, *([] if log is None else [_file(log)])], force=True
    )
    logging.getLogger(SAID).info("%s", shlex.join(["armhil", *sys.argv[1:]]))
    if not verbose:
        # What goes wrong on the bus is told by the exception that comes of it, in one line.
        for library in ("can", "canopen"):
            logging.getLogger(library).setLevel(logging.CRITICAL)


def _file(path: Path) -> logging.Handler:
    """A log file that only its owner reads, a line an event, in UTC.

    Raises:
        OSError: it cannot be written.
    """
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600))
    path.chmod(0o600)  # one of before too
    handler = logging.FileHandler(path, encoding="utf-8")
    formatter = OneLine("%(asctime)s %(levelname)s %(name)s: %(message)s", "%Y-%m-%dT%H:%M:%SZ")
    formatter.converter = time.gmtime
    handler.setFormatter(formatter)
    return handler


class OneLine(logging.Formatter):
    """An event is one line, whatever is in it."""

    def format(self, record: logging.LogRecord) -> str:
        """The line; a traceback's lines are joined."""
        return " ".join(super().format(record).split())
