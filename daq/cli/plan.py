"""`armhil plan`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    CELL_FILE,
    FAILED,
    OK,
    UNKNOWN,
    WARNING,
    Json,
    Periods,
    Quiet,
    RobotArgument,
    console_of,
    file_of,
    print_json,
    steps_of,
)


@app.command()
def plan(
    robot: RobotArgument,
    check: Annotated[
        Path | None,
        typer.Option(
            help="Judge this trajectory (.json, .csv, .mcap) instead of planning one.",
            callback=file_of("a trajectory"),
        ),
    ] = None,
    objective: Annotated[
        str, typer.Option(help="determinant, trace or condition: what is minimised.")
    ] = "determinant",
    parameters: Annotated[
        str | None, typer.Option(help="Only these: payload, friction4, joint2, ZZ1R, …", show_default="all")
    ] = None,
    family: Annotated[str, typer.Option(help="ruckig or fourier.")] = "ruckig",
    duration: Annotated[float, typer.Option(min=0.1, max=600.0, help="One period of the motion, s.")] = 12.0,
    periods: Periods = 1,
    speed: Annotated[float, typer.Option(help="The same path slower, e.g. 0.1 for a first run.")] = 1.0,
    start: Annotated[
        str | None, typer.Option(help="Where the arm stands: n positions, comma.", show_default="home")
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(
            help="cell.toml: floor, obstacles, tool.",
            callback=file_of(CELL_FILE),
        ),
    ] = None,
    floor: Annotated[float | None, typer.Option(help="Height of a floor, m.", show_default="none")] = None,
    tool_speed: Annotated[
        float | None, typer.Option(help="Highest speed of the tool, m/s.", show_default="none")
    ] = None,
    earlier: Annotated[
        Path | None,
        typer.Option(
            help="An earlier capture or model of the arm: errors and values to expect.",
            callback=file_of("a capture or a model file of the arm"),
        ),
    ] = None,
    cycle_time: Annotated[
        float | None, typer.Option(help="Between set-points, s.", show_default="the robot's")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed is the same motion.")] = 0,
    evaluations: Annotated[int, typer.Option(min=1, help="Trials of each search.")] = 12000,
    searches: Annotated[int, typer.Option(min=1, help="Independent searches; the best counts.")] = 2,
    workers: Annotated[int, typer.Option(min=1, help="Processes for them.")] = 2,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder.", show_default="runs/<time>-plan-<robot>")
    ] = None,
    power: Annotated[
        bool, typer.Option("--power", help="How small each effect could be and still be named, as a map.")
    ] = False,
    wanted: Annotated[
        str | None,
        typer.Option("--for", help="EFFECT@JOINT=SIZE: the motion that would name it.", show_default="none"),
    ] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Plan an exciting trajectory, or judge any trajectory, before anything moves.

    Example: [bold]armhil plan tx40 --seed 1 --out runs/plan[/]
    """
    import robots
    from daq.planning.plan import run_plan
    from daq.planning.plan_for import wanted_of
    from daq.planning.plan_json import plan_json
    from daq.planning.plan_options import criterion_of, family_of, posture_of, words_of
    from daq.planning.plan_result import PlanRequest
    from daq.planning.plan_terminal import print_plan

    console = console_of(as_json)
    request = PlanRequest(
        robot=robots.load(robot),
        check=check,
        family=family_of(family),
        criterion=criterion_of(objective),
        parameters=words_of(parameters),
        duration=duration,
        periods=periods,
        seed=seed,
        evaluations=evaluations,
        searches=searches,
        workers=workers,
        speed=speed,
        start=posture_of(start),
        cell=cell,
        floor=floor,
        tool_speed=tool_speed,
        cycle_time=cycle_time,
        earlier=earlier,
        out=out,
        power=power,
        wanted=None if wanted is None else wanted_of(wanted),
    )
    result = run_plan(request, steps_of(console, quiet))
    if as_json:
        print_json(plan_json(result))
    print_plan(console, result)
    return {"fine": OK, "weak": WARNING, "refused": FAILED, "unmeasurable": UNKNOWN}[result.verdict]
