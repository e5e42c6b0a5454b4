"""`armhil doctor`."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import ChannelName, Interface, Json, bus_of, console_of, found, print_json


@app.command()
def doctor(
    robot: Annotated[
        str | None,
        typer.Argument(
            help="A shipped arm (see `armhil robots`) or a robot.toml; without one, this machine.",
            callback=found,
        ),
    ] = None,
    interface: Interface = None,
    channel: ChannelName = None,
    as_json: Json = False,
) -> int:
    """Is this machine fit to drive this arm? Each check with what to do about it; nothing moves.

    Example: [bold]armhil doctor tx40[/]
    """
    import robots
    from daq.doctor.check import CODES, worst
    from daq.doctor.doctor import describe, doctor_json, examine

    arm = None if robot is None else robots.load(robot)
    bus = None if arm is None else bus_of(arm, interface, channel)
    checks = examine(arm, bus)
    if as_json:
        print_json(doctor_json(arm, bus, checks))
    console_of(as_json).print(describe(checks), highlight=False, markup=False, soft_wrap=True)
    return CODES[worst(checks)]
