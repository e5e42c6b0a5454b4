"""`armhil acknowledge`."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, ChannelName, Interface, RobotArgument, bus_of, console_of


@app.command()
def acknowledge(
    robot: RobotArgument,
    interface: Interface = None,
    channel: ChannelName = None,
    yes: Annotated[bool, typer.Option("--yes", help="Somebody has looked already.")] = False,
) -> int:
    """Reset the drives' faults after somebody has looked at the arm; nothing moves and no torque comes on.

    Example: [bold]armhil acknowledge tx40[/]
    """
    import robots
    from daq.session.acknowledgement import acknowledge as reset
    from daq.session.questions import answered

    console = console_of(as_json=False)
    arm = robots.load(robot)

    def looked(standing: tuple[str, ...]) -> bool:
        for line in standing:
            console.print(line, highlight=False, soft_wrap=True)
        if yes:
            return True
        nobody = "asks whether somebody has looked; give --yes where nobody can answer"
        return answered("Has somebody looked at the arm, and is the cause gone?", nobody)

    if reset(arm, bus_of(arm, interface, channel), looked):
        console.print("[green]Acknowledged[/]; no drive is in fault.", highlight=False)
    else:
        console.print("Nothing stands to be acknowledged.", highlight=False)
    return OK
