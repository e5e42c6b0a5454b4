"""`armhil jog`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

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
    joint: Annotated[
        str | None, typer.Option(help="Number (from 1) or name of the joint.", show_default="chosen by keys")
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(help="How far: 0.05 (rad or m), -3deg, 2mm.", show_default="while a key is held"),
    ] = None,
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
    """Move one joint a little, slowly; without --joint and --by, while its key is held.

    Keys while it moves a given way: a stop, h halt.

    Example: [bold]armhil jog tx40 --joint 3 --by 2deg --simulated[/]
    """
    from daq.files.run_folder import make_run_folder
    from daq.session.cell import cell_of
    from daq.session.session_error import SessionError

    if (joint is None) != (by is None):
        raise SessionError("--joint and --by go together; without both, a joint moves while its key is held")
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

    def common() -> dict[str, Any]:
        return {
            "arm": order,
            "folder": make_run_folder(out, f"jog-{order.robot.name}"),
            "speed": speed,
            "cell": cell_of(cell),
            "note": note or "",
            "catalogue": catalogue_of(no_catalogue),
            "confirm": asking(yes, simulated, as_json),
        }

    if joint is None or by is None:
        return _hold(console, order.robot, common, quiet, as_json)
    from daq.session.jog import JogRequest
    from daq.session.jog import jog as move
    from daq.session.keyboard import by_keyboard
    from daq.session.recorded_runs import require_completed
    from daq.session.session_json import jog_json

    request = JogRequest(joint=joint, by=by, **common())
    watcher = watcher_of(console, order.robot, quiet)
    result = move(request, steps_of(console, quiet), watcher, by_keyboard)
    if as_json:
        print_json(jog_json(result, order))
    require_completed(result.stream, result.capture)
    console.print(f"Capture: [bold]{result.capture}[/]", soft_wrap=True, highlight=False)
    return OK


def _hold(console: Any, robot: Any, common: Callable[[], dict[str, Any]], quiet: bool, as_json: bool) -> int:
    """A joint moves while its key is held, for somebody who sits at the terminal.

    Raises:
        NotMoved: nobody does.
    """
    from daq.session.held_keys import HeldKeys
    from daq.session.hold_to_run import hold_to_run, numbers
    from daq.session.hold_view import HoldView
    from daq.session.jog import HandRequest
    from daq.session.questions import terminal
    from daq.session.session_error import NotMoved

    keyboard = terminal()
    if keyboard is None or as_json or not console.is_terminal:
        raise NotMoved("keys are held at a terminal; elsewhere give --joint and --by")
    request = HandRequest(**common())
    result = hold_to_run(request, steps_of(console, quiet), HeldKeys(keyboard), HoldView(console, robot))
    for number, posture in enumerate(result.postures, 1):
        console.print(f"Posture {number}, to start a plan there: --start={numbers(posture, ',')}")
        console.print(f"  as home in robot.toml: home = [{numbers(posture, ', ')}]", soft_wrap=True)
    console.print(
        f"{len(result.captures)} motions in [bold]{request.folder}[/]", soft_wrap=True, highlight=False
    )
    return OK
