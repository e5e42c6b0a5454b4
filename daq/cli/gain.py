"""`armhil gain`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, Columns, Json, Quiet, RobotOfRecording, console_of, print_json, steps_of, there


@app.command()
def gain(
    paths: Annotated[
        list[Path], typer.Argument(help="Captures or logs without the payload.", callback=there)
    ],
    loaded: Annotated[
        list[Path],
        typer.Option(
            "--loaded", help="A capture or log with the payload on; may be repeated.", callback=there
        ),
    ],
    payload: Annotated[
        Path, typer.Option("--payload", help="payload.toml: its mass, centre and inertia if known.")
    ],
    robot: RobotOfRecording = None,
    columns: Columns = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Identify the drive gains from recordings without and with a known payload.

    Example: [bold]armhil gain runs/a/capture.mcap --loaded runs/b/capture.mcap --payload payload.toml[/]
    """
    from daq.identification.drive_gains import GainRequest, gains_json, print_gains, run_gain

    console = console_of(as_json)
    request = GainRequest(tuple(paths), tuple(loaded), payload, robot, columns)
    result = run_gain(request, steps_of(console, quiet))
    if as_json:
        print_json(gains_json(result, request))
    print_gains(console, result)
    return OK
