"""What the commands share: exit codes, options, and where they print."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

OK, WARNING, FAILED, UNKNOWN, INTERRUPTED = 0, 1, 2, 3, 130

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout; text goes to stderr.")]
RobotName = Annotated[
    str, typer.Option("--robot", help="A shipped arm (see `armhil robots`) or a robot.toml.")
]
Out = Annotated[
    Path | None, typer.Option("--out", help="Folder for the results.", show_default="runs/<time>-<robot>")
]
NoCatalogue = Annotated[bool, typer.Option("--no-catalogue", help="Keep nothing of this in the catalogue.")]
RunNumber = Annotated[int, typer.Argument(help="Number of a run (see `armhil runs`).", metavar="RUN")]


def say(text: str) -> None:
    sys.stderr.write(f"armhil: {text}\n")


def code_of(verdict: str) -> int:
    """A model that must not be trusted is a warning to whoever calls this from a script."""
    return WARNING if verdict == "instruments_invalid" else OK


def bus_of(arm: Any, interface: str | None, channel: str | None) -> Any:
    """The bus that was asked for, else the arm's own."""
    from drivers import Channel

    return Channel(
        arm.bus.interface if interface is None else interface, arm.bus.channel if channel is None else channel
    )


def console_of(as_json: bool) -> Any:
    """Where a person reads: stdout, or stderr when stdout carries JSON."""
    from rich.console import Console

    return Console(stderr=as_json)


def print_json(content: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    sys.stdout.flush()


def catalogue_of(without: bool) -> Any:
    """The user's catalogue, opened before anything is done; None where nothing is to be kept.

    Raises:
        CatalogueError: it cannot be opened.
    """
    from daq.catalogue.database import Catalogue

    return None if without else Catalogue()
