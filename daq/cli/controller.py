"""`armhil controller`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    OK,
    WARNING,
    Columns,
    Json,
    Quiet,
    RobotOfRecording,
    console_of,
    print_json,
    steps_of,
    there,
)


@app.command()
def controller(
    paths: Annotated[
        list[Path], typer.Argument(help="Captures or logs with position references.", callback=there)
    ],
    robot: RobotOfRecording = None,
    columns: Columns = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Identify the drives' control law from set-points, positions and control signals.

    Example: [bold]armhil controller runs/first/capture.mcap[/]
    """
    from daq.identification.controller import controller_json, print_controller, run_controller

    console = console_of(as_json)
    result = run_controller(tuple(paths), robot, columns, steps_of(console, quiet))
    if as_json:
        print_json(controller_json(result, [str(path) for path in paths]))
    print_controller(console, result)
    return OK if result.found.trusted else WARNING
