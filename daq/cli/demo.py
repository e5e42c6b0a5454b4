"""The whole chain on simulated drives."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    ChannelName,
    Evaluations,
    Interface,
    Json,
    NoCatalogue,
    Out,
    Parameters,
    Periods,
    Quiet,
    RobotName,
    bus_of,
    catalogue_of,
    code_of,
    console_of,
    file_of,
    print_json,
    steps_of,
    watcher_of,
)


@app.command()
def demo(
    robot: RobotName = "tx40",
    interface: Interface = None,
    channel: ChannelName = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated arm, its noise and the trajectory.")] = 0,
    scenario: Annotated[
        Path | None,
        typer.Option(
            help="A scenario.toml: what the arm hides, for `armhil diagnose` to find.",
            show_default="nothing",
            callback=file_of("a scenario.toml"),
        ),
    ] = None,
    out: Out = None,
    duration: Annotated[float, typer.Option(min=2.0, max=120.0, help="One period of the motion, s.")] = 12.0,
    periods: Periods = 2,
    evaluations: Evaluations = 6000,
    quiet: Quiet = False,
    no_catalogue: NoCatalogue = False,
    parameters: Parameters = False,
    as_json: Json = False,
) -> int:
    """Run the whole chain on simulated drives: plan, stream, record, identify, test, report.

    Example: [bold]armhil demo --robot tx40 --seed 3 --out runs/first[/]
    """
    import robots
    from daq.cli.demonstration import DemoRequest, run_demo
    from daq.files.model_file import SUFFIX
    from daq.files.run_folder import make_run_folder
    from daq.identification.identification_json import identification_json
    from daq.identification.terminal import print_identification
    from daq.session.keyboard import by_keyboard
    from daq.text.wrapped import write

    arm = robots.load(robot)
    bus = bus_of(arm, interface, channel)
    catalogue = catalogue_of(no_catalogue)
    folder = make_run_folder(out, arm.name)
    console = console_of(as_json)
    request = DemoRequest(
        arm,
        robot,
        bus,
        seed,
        folder,
        duration,
        periods,
        evaluations,
        catalogue,
        watcher=watcher_of(console, arm, quiet) if console.is_terminal else None,
        conducting=by_keyboard,
        any_group=interface is None and channel is None,
        scenario=scenario,
    )
    result = run_demo(request, steps_of(console, quiet))
    if as_json:
        print_json(identification_json(result.fitted.result, [str(result.capture.path)], result.truth))
    model = folder / f"{arm.name}{SUFFIX}"
    print_identification(console, result.fitted, result.truth, model, parameters)
    write(console, f"\nReport: {result.report}")
    if result.run is not None:
        write(console, f"Run {result.run} of the catalogue: armhil show {result.run}")
    return code_of(result.fitted.result)
