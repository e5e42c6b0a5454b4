"""`armhil run`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    OK,
    WARNING,
    CellOption,
    Celsius,
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
    file_of,
    print_json,
    steps_of,
    watcher_of,
)


@app.command()
def run(
    robot: RobotArgument,
    trajectory: Annotated[
        Path,
        typer.Argument(help="What to drive (.json, .csv, .mcap).", callback=file_of("a trajectory")),
    ],
    interface: Interface = None,
    channel: ChannelName = None,
    simulated: Simulated = False,
    seed: SimulatedSeed = 0,
    speed: Annotated[float, typer.Option(help="The same path slower, e.g. 0.1 for a first run.")] = 1.0,
    approach: Annotated[
        bool, typer.Option("--approach", help="Go slowly to where the trajectory begins.")
    ] = False,
    cell: CellOption = None,
    stands_at: StandsAt = None,
    new_arm: NewArm = False,
    not_commissioned: NotCommissioned = False,
    celsius: Celsius = None,
    note: Note = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder.", show_default="runs/<time>-run-<robot>")
    ] = None,
    yes: Yes = False,
    quiet: Quiet = False,
    no_catalogue: NoCatalogue = False,
    as_json: Json = False,
) -> int:
    """Stream a trajectory to an arm and record it; keys while it moves: p pause, s stop, a abort, h halt.

    Example: [bold]armhil run tx40 runs/plan/tx40.trajectory.json --simulated --approach[/]
    """
    from daq.files.run_folder import make_run_folder
    from daq.session.cell import cell_of
    from daq.session.keyboard import by_keyboard
    from daq.session.recorded_runs import require_completed
    from daq.session.run import RunRequest, run_trajectory
    from daq.session.session_json import run_json

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
    catalogue = catalogue_of(no_catalogue)
    request = RunRequest(
        order,
        trajectory,
        make_run_folder(out, f"run-{order.robot.name}"),
        speed,
        approach,
        note or "",
        catalogue,
        cell_of(cell),
        asking(yes, simulated, as_json),
        celsius,
    )
    watcher = watcher_of(console, order.robot, quiet)
    result = run_trajectory(request, steps_of(console, quiet), watcher, by_keyboard)
    if as_json:
        print_json(run_json(result, order))
    require_completed(result.stream, result.capture)
    console.print(f"Capture: [bold]{result.capture}[/]", soft_wrap=True, highlight=False)
    if result.run is not None:
        console.print(f"Run [bold]{result.run}[/] of the catalogue", highlight=False)
    return WARNING if result.stream.doubtful else OK
