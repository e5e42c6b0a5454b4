"""`armhil recover`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, console_of, print_json, there


@app.command()
def recover(
    file: Annotated[Path, typer.Argument(help="A damaged capture (.mcap).", callback=there)],
    out: Annotated[
        Path | None, typer.Option("--out", help="The new file.", show_default="<file>.recovered.mcap")
    ] = None,
    robot: Annotated[
        str | None, typer.Option(help="The arm, where the file's description is lost.", show_default="none")
    ] = None,
    as_json: Json = False,
) -> int:
    """Rebuild a readable capture from a killed, cut-off or damaged one; say what is missing.

    Example: [bold]armhil recover runs/first/capture.mcap[/]
    """
    import robots
    from daq.recording.recovery import SUFFIX, recovery_json, recovery_text
    from daq.recording.recovery import recover as rebuild

    arm = None if robot is None else robots.load(robot)
    result = rebuild(file, out if out is not None else file.with_suffix(SUFFIX), arm)
    if as_json:
        print_json(recovery_json(result))
    for line in recovery_text(result):
        console_of(as_json).print(line, highlight=False, markup=False, soft_wrap=True)
    return OK if result.whole else WARNING
