"""`armhil protocol`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, console_of, found, print_json


@app.command()
def protocol(
    arm: Annotated[str, typer.Argument(help="Label of an arm (see `armhil runs`).", metavar="ARM")],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help="A shipped arm or a robot.toml.",
            show_default="as the recordings say",
            callback=found,
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="New .html or .pdf.", show_default="<ARM>-commissioning.html")
    ] = None,
    as_json: Json = False,
) -> int:
    """Write the protocol of an arm's commissioning: one page with figures, to be signed.

    Example: [bold]armhil protocol tx40 --out tx40.pdf[/]
    """
    from daq.catalogue.database import Catalogue
    from daq.protocol.content import protocol_of
    from daq.protocol.writing import protocol_json, target_of, write_protocol
    from daq.text.wrapped import write

    target = target_of(out, arm)
    with Catalogue() as catalogue:
        content = protocol_of(catalogue, arm, robot)
    write_protocol(target, content)
    if as_json:
        print_json(protocol_json(content, target))
    console = console_of(as_json)
    write(console, f"{content.verdict}{', on simulated drives' if content.simulated else ''}.")
    for remark in content.remarks:
        write(console, remark, indent="  ")
    write(console, f"Protocol: {target}")
    return OK if content.commissioned else WARNING
