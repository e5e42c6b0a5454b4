"""`armhil sim`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import ChannelName, Interface, RobotArgument, SimulatedSeed, bus_of, file_of


@app.command()
def sim(
    robot: RobotArgument,
    interface: Interface = None,
    channel: ChannelName = None,
    seed: SimulatedSeed = 0,
    scenario: Annotated[
        Path | None,
        typer.Option(
            help="A scenario.toml: what the arm hides. Only the drives' process reads it.",
            callback=file_of("a scenario.toml"),
        ),
    ] = None,
    seal: Annotated[
        Path | None, typer.Option(help="New file for the sealed truth, which scoring opens later.")
    ] = None,
    profile: Annotated[
        str, typer.Option(help="Kind of drives, with what it does otherwise than the standard.")
    ] = "cia402",
) -> None:
    """Run the simulated drives alone, as a bench for anyone's master; Ctrl-C ends them.

    Example: [bold]armhil sim tx40 --interface socketcan --channel vcan0[/]
    """
    import robots
    from daq.cli.simulated_arm import run_simulation

    bus = bus_of(robots.load(robot), interface, channel)
    run_simulation(robot, bus, seed, typer.echo, scenario=scenario, seal=seal, profile=profile)
