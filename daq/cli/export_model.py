"""`armhil export-model`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import Json, code_of, console_of, found, print_json, there


@app.command("export-model")
def export_model(
    model: Annotated[Path, typer.Argument(help="A model (.model.toml).", callback=there)],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", help="A shipped arm or a robot.toml.", show_default="the model's", callback=found
        ),
    ] = None,
    kind: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            help="urdf, mjcf, sdf, pinocchio, c, python or limits; may be repeated.",
            show_default="all",
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder.", show_default="elsewhere, beside it")] = None,
    as_json: Json = False,
) -> int:
    """Write an identified arm for simulators and controllers, and say what each file cannot hold.

    Example: [bold]armhil export-model runs/first/tx40.model.toml --format mjcf[/]
    """
    import robots
    from daq.exporting.elsewhere.export import export_model as write_all
    from daq.exporting.elsewhere.export import export_model_json, in_no_file
    from daq.files.model_file import read_model
    from daq.text.wrapped import write

    content = read_model(model)
    arm = robots.load(content.robot.name if robot is None else robot)
    written = write_all(model, arm, model.parent / "elsewhere" if out is None else out, tuple(kind or ()))
    if as_json:
        print_json(export_model_json(model, written))
    console = console_of(as_json)
    nowhere = in_no_file(written)
    for one in written:
        write(console, f"{one.path}")
        for sentence in (sentence for sentence in one.lost if sentence not in nowhere):
            write(console, f"  not in it: {sentence}", indent="    ")
    for sentence in nowhere:
        write(console, f"In none of them: {sentence}", indent="  ")
    if not content.estimate.trusted:
        write(console, f"Do not trust these files yet: {content.estimate.recommendation}", style="bold red")
    return code_of(content.estimate)
