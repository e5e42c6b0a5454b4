"""`armhil commission`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    OK,
    CellOption,
    Celsius,
    ChannelName,
    Evaluations,
    Interface,
    Json,
    NewArm,
    NoCatalogue,
    Periods,
    Quiet,
    RobotArgument,
    Simulated,
    StandsAt,
    Yes,
    arm_order_of,
    asking,
    catalogue_of,
    console_of,
    file_of,
    looked_by,
    print_json,
    steps_of,
    watcher_of,
)


@app.command()
def commission(
    robot: RobotArgument,
    move: Annotated[
        bool,
        typer.Option("--move/--dry-run", help="Go through the stages; else nothing is sent or moved."),
    ] = False,
    trajectory: Annotated[
        Path | None,
        typer.Option(
            help="A trajectory to commission with.",
            show_default="one is planned",
            callback=file_of("a trajectory"),
        ),
    ] = None,
    cell: CellOption = None,
    duration: Annotated[float, typer.Option(min=2.0, max=120.0, help="One period of the plan, s.")] = 12.0,
    periods: Periods = 2,
    evaluations: Evaluations = 6000,
    first: Annotated[
        str | None,
        typer.Option(
            "--from", help="Begin with this stage again.", show_default="the first that has not passed"
        ),
    ] = None,
    last: Annotated[
        str | None, typer.Option("--until", help="End with this stage.", show_default="return")
    ] = None,
    slow_speed: Annotated[float, typer.Option(help="Of the slow run; at most a tenth.")] = 0.1,
    rounds: Annotated[int, typer.Option(min=1, max=100, help="Of the warm-up.")] = 1,
    interface: Interface = None,
    channel: ChannelName = None,
    simulated: Simulated = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the plan, and of a simulated arm.")] = 0,
    stands_at: StandsAt = None,
    new_arm: NewArm = False,
    celsius: Celsius = None,
    note: Annotated[
        str | None, typer.Option(help="To be remembered of the runs.", show_default="none")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder.", show_default="runs/<time>-commission-<robot>")
    ] = None,
    yes: Yes = False,
    looked: Annotated[
        bool,
        typer.Option(
            "--looked", help="Somebody watches which way each joint goes, and has measured the gains."
        ),
    ] = False,
    quiet: Quiet = False,
    no_catalogue: NoCatalogue = False,
    as_json: Json = False,
) -> int:
    """Walk an arm to its first full run, stage by stage; nothing moves unless --move is given.

    Keys while it moves: p pause, s stop, a abort, h halt.

    Example: [bold]armhil commission tx40[/]
    """
    from daq.files.run_folder import make_run_folder
    from daq.session.cell import cell_of
    from daq.session.commission import StageDone
    from daq.session.commission import commission as go_through
    from daq.session.dry_run import CommissionRequest, plan_commission
    from daq.session.keyboard import by_keyboard
    from daq.session.session_json import commission_json
    from daq.session.session_terminal import print_done, print_planned
    from daq.session.stages import stage_of

    console = console_of(as_json)
    order = arm_order_of(
        robot,
        interface,
        channel,
        simulated=simulated,
        seed=seed,
        new_arm=new_arm,
        stands_at=stands_at,
    )
    request = CommissionRequest(
        order,
        make_run_folder(out, f"commission-{order.robot.name}"),
        trajectory=trajectory,
        duration=duration,
        periods=periods,
        evaluations=evaluations,
        seed=seed,
        first=stage_of("--from", first),
        last=stage_of("--until", last),
        slow_speed=slow_speed,
        rounds=rounds,
        note=note or "",
        catalogue=catalogue_of(no_catalogue),
        cell=cell_of(cell),
        confirm=asking(yes, simulated, as_json),
        looked=looked_by(looked, simulated, as_json),
        celsius=celsius,
    )
    steps = steps_of(console, quiet)
    planned = plan_commission(request, steps)
    given: dict[str, object] = {"--interface": interface, "--channel": channel, "--cell": cell}
    given |= {"--stands-at": stands_at, "--seed": seed or None, "--celsius": celsius}
    options = [str(word) for key, value in given.items() if value is not None for word in (key, value)]
    flags = [word for word, is_given in (("--simulated", simulated), ("--new-arm", new_arm)) if is_given]
    onward = ["armhil", "commission", robot, *options, *flags]
    print_planned(console, planned, request, None if move else onward)
    done: tuple[StageDone, ...] = ()
    if move:
        watcher = watcher_of(console, order.robot, quiet)
        done = go_through(request, planned, steps, watcher, by_keyboard)
        print_done(console, done)
    if as_json:
        print_json(commission_json(planned, done, request))
    return OK
