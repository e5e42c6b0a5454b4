"""`armhil serve`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, console_of, say

VARIABLES = ("ARMHIL_CATALOGUE", "ARMHIL_SERVICE", "ARMHIL_FLEET", "ARMHIL_NOTIFY", "ARMHIL_STATE")
"""What the service has to find as whoever installs it does."""


@app.command()
def serve(
    host: Annotated[
        str | None, typer.Option(help="Address to listen on.", show_default="service.toml's, else 127.0.0.1")
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="0 takes a free one.", show_default="service.toml's, else 8090"),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="service.toml.", show_default="the user's, if there is one")
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for checks that are started here.")] = Path(
        "runs"
    ),
    unit: Annotated[
        bool, typer.Option("--unit", help="Only print a systemd unit that serves with these options.")
    ] = False,
) -> int:
    """Show arms, runs, trends and live runs in a browser; REST and Prometheus metrics beside it.

    Example: [bold]armhil serve --port 8090[/]
    """
    from daq.service.settings import read_service
    from daq.service.units import serving_unit

    if unit:
        given = {"--host": host, "--port": port, "--config": config, "--out": out.absolute()}
        options = [word for name, value in given.items() if value is not None for word in (name, str(value))]
        console_of(False).print(
            serving_unit(tuple(options), Path.cwd(), VARIABLES), soft_wrap=True, highlight=False, markup=False
        )
        return OK
    service = read_service(config, host, port)
    from daq.service.app import serve as run_service

    run_service(service, out, lambda address: say(f"serving {address}; Ctrl-C ends it"))
    return OK
