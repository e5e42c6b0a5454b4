"""`armhil export`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, console_of, print_json, there


@app.command()
def export(
    capture: Annotated[Path, typer.Argument(help="A capture (.mcap).", callback=there)],
    kind: Annotated[
        str, typer.Option("--format", help="csv, parquet, mat, rosbag2, urdf, blf or asc.")
    ] = "csv",
    out: Annotated[
        Path | None, typer.Option("--out", help="The new file.", show_default="<capture>.<format>")
    ] = None,
    as_json: Json = False,
) -> int:
    """Write a capture's samples, arm or raw frames in the form of other programs.

    Example: [bold]armhil export runs/first/capture.mcap --format mat[/]
    """
    from daq.exporting.export import export_capture, export_json

    exported = export_capture(capture, kind, out)
    if as_json:
        print_json(export_json(capture, kind, exported))
    what = "the arm's URDF" if exported.rows is None else f"{exported.rows} rows"
    lines = [f"{exported.path}: {what}"]
    lines += [f"{exported.map}: column map that reads it back"] if exported.map else []
    lines += [f"missing: {sentence}" for sentence in exported.warnings]
    for line in lines:
        console_of(as_json).print(line, markup=False, highlight=False, soft_wrap=True)
    return WARNING if exported.warnings else OK
