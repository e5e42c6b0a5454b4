"""`armhil home`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    OK,
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
)


@app.command()
def home(
    robot: RobotArgument,
    joint: Annotated[
        list[str] | None,
        typer.Option(
            help="Number or name; its drive searches; may be repeated.",
            show_default="those that forget their position",
        ),
    ] = None,
    search: Annotated[
        bool, typer.Option("--search/--no-search", help="Whether drives search their home.")
    ] = True,
    interface: Interface = None,
    channel: ChannelName = None,
    simulated: Simulated = False,
    seed: SimulatedSeed = 0,
    stands_at: StandsAt = None,
    new_arm: NewArm = False,
    not_commissioned: NotCommissioned = False,
    note: Note = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder.", show_default="runs/<time>-home-<robot>")
    ] = None,
    yes: Yes = False,
    quiet: Quiet = False,
    no_catalogue: NoCatalogue = False,
    as_json: Json = False,
) -> int:
    """Have drives search their home, then compare what they say with the arm; keys: a stop, h halt.

    Example: [bold]armhil home tx40 --simulated[/]
    """
    from daq.files.run_folder import make_run_folder
    from daq.session.home import HomeRequest
    from daq.session.home import home as go_home
    from daq.session.home_terminal import print_posture
    from daq.session.keyboard import by_keyboard
    from daq.session.session_json import home_json

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
    request = HomeRequest(
        order,
        make_run_folder(out, f"home-{order.robot.name}"),
        (tuple(joint) if joint else None) if search else (),
        note or "",
        catalogue_of(no_catalogue),
        asking(yes, simulated, as_json),
        _looking(simulated, as_json),
        lambda posture: print_posture(console, order.robot, posture),
    )
    result = go_home(request, steps_of(console, quiet), by_keyboard)
    if as_json:
        print_json(home_json(result, order))
    where = "not kept" if result.run is None else f"kept as run {result.run}"
    console.print(f"[green]Attested[/], {where}.", highlight=False)
    return OK


def _looking(simulated: bool, as_json: bool) -> Callable[[str], bool]:
    """Who looks at the arm: a person at the terminal; ``--yes`` has no eyes.

    Raises:
        NotMoved: when asked where nobody can answer.
    """
    from daq.session.questions import answered

    nobody = "somebody has to look at the arm; give --stands-at where nobody can answer"
    if simulated:
        return lambda question: True
    return lambda question: answered(question, nobody, err=as_json)
