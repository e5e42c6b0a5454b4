"""`armhil robots`."""

from __future__ import annotations

import typer

from daq.cli.app import app


@app.command()
def robots() -> None:
    """List the arms that ship.

    Example: [bold]armhil robots[/]
    """
    import robots as shipped_robots

    for name in shipped_robots.shipped():
        arm = shipped_robots.load(name)
        typer.echo(f"{name:8} {arm.n} joints  {arm.description}")
