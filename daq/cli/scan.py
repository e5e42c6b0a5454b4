"""`armhil scan`."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, UNKNOWN, Json, console_of, print_json


@app.command()
def scan(
    interface: Annotated[str, typer.Option("--interface", help="python-can interface.")] = "socketcan",
    channel: Annotated[str, typer.Option("--channel", help="Channel on it.")] = "can0",
    bitrate: Annotated[int, typer.Option("--bitrate", min=10_000, max=1_000_000, help="bit/s.")] = 1_000_000,
    as_json: Json = False,
) -> int:
    """Who is on a bus? Identity, units, limits, modes and PDOs of each drive, and a draft for robot.toml.

    Reads only: nothing is written to a drive, and none gets torque.

    Example: [bold]armhil scan --channel can0[/]
    """
    from daq.doctor.scan_words import describe_scan, scan_json
    from drivers import Channel
    from drivers.setup.draft import draft
    from drivers.setup.scan import scan as ask

    bus = Channel(interface, channel)
    found = ask(bus, bitrate)
    text = draft(found)
    if as_json:
        print_json(scan_json(bus, found, text))
    console = console_of(as_json)
    console.print(describe_scan(bus, found), highlight=False, markup=False, soft_wrap=True)
    if found:
        console.print(text, highlight=False, markup=False, soft_wrap=True)
    return OK if found else UNKNOWN
