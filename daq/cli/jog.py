"""`armhil jog`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    OK,
    CellOption,
    ChannelName,
    Interface,
    Json,
    NewArm,
    NoCatalogue,
    NotCommissioned,
    Note,
    Quiet,
    RobotArgument,
    Simulated,
    SimulatedSeed,
    StandsAt,
    Yes,
    arm_order_of,
    asking,
    catalogue_of,
    console_of,
    print_json,
    steps_of,
    watcher_of,
)


@app.command()
def jog(
    robot: RobotArgument,
    joint: Annotated[str, typer.Option(help="Number (from 1) or name of the joint.")],
    by: Annotated[str, typer.Option(help="How far: 0.05 (rad or m), -3deg, 2mm.")],
    speed: Annotated[float, typer.Option(help="Share of its speed; at most a tenth.")] = 0.05,
    interface: Interface = None,
    channel: ChannelName = None,
    simulated: Simulated = False,
    seed: SimulatedSeed = 0,
    cell: CellOption = None,
    stands_at: StandsAt = None,
    new_arm: NewArm = False,
    not_commissioned: NotCommissioned = False,
    note: Note = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder.", show_default="runs/<time>-jog-<robot>")
    ] = None,
    yes: Yes = False,
    quiet: Quiet = False,
    no_catalogue: NoCatalogue = False,
    as_json: Json = False,
) -> int:
    """Move one joint a little, slowly; keys while it moves: s, a stop, h halt.

    Example: [bold]armhil jog tx40 --joint 3 --by 2deg --simulated[/]
    """
    from daq.files.run_folder import make_run_folder
    from daq.session.cell import cell_of
    from daq.session.jog import JogRequest
    from daq.session.jog import jog as move
    from daq.session.keyboard import by_keyboard
    from daq.session.moves_json import jog_json
    from daq.session.recorded_runs import require_completed

    console = console_of(as_json)
    order = arm_order_of(
        robot,
        interface,
        channel,
        simulated=simulated,
        seed=seed,
        new_arm=new_arm,
        stands_at=stands_at,
        not_commissioned=not_commissioned,
        as_json=as_json,
    )
    request = JogRequest(
        order,
        joint,
        by,
        make_run_folder(out, f"jog-{order.robot.name}"),
        speed,
        cell_of(cell),
        note or "",
        catalogue_of(no_catalogue),
        asking(yes, simulated, as_json),
    )
    watcher = watcher_of(console, order.robot, quiet)
    result = move(request, steps_of(console, quiet), watcher, by_keyboard)
    if as_json:
        print_json(jog_json(result, order))
    require_completed(result.stream, result.capture)
    console.print(f"Capture: [bold]{result.capture}[/]", soft_wrap=True, highlight=False)
    return OK
