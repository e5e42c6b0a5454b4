"""`armhil check`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.cli.app import app
from daq.cli.common import (
    CellOption,
    Celsius,
    ChannelName,
    Interface,
    Json,
    NewArm,
    Parameters,
    Quiet,
    Simulated,
    StandsAt,
    arm_order_of,
    console_of,
    file_of,
    found,
    print_json,
    say,
    steps_of,
    watcher_of,
)

if TYPE_CHECKING:
    from daq.catalogue.database import Catalogue
    from daq.check.request import CheckResult

OF_ONE_ARM = (
    "interface",
    "channel",
    "simulated",
    "seed",
    "noise_seed",
    "scenario",
    "trajectory",
    "cell",
    "stands_at",
    "new_arm",
)
"""Options that a fleet.toml says for each arm, or that a fleet has not."""
OF_A_FLEET = ("fleet", "at_once", "jobs", "backend")


@app.command()
def check(
    context: typer.Context,
    robot: Annotated[
        str | None,
        typer.Argument(
            help="A shipped arm (see `armhil robots`) or a robot.toml.",
            show_default="with --all",
            callback=found,
        ),
    ] = None,
    everyone: Annotated[bool, typer.Option("--all", help="Every arm of the fleet.")] = False,
    fleet: Annotated[
        Path | None,
        typer.Option(
            help="fleet.toml of --all.",
            show_default="the user's",
            callback=file_of("a fleet (fleet.toml)"),
        ),
    ] = None,
    interface: Interface = None,
    channel: ChannelName = None,
    simulated: Simulated = False,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated arm.")] = 0,
    noise_seed: Annotated[
        int | None,
        typer.Option(min=0, help="Of its noise, to repeat a run.", show_default="another one for every run"),
    ] = None,
    scenario: Annotated[
        Path | None,
        typer.Option(
            help="A scenario.toml: what the simulated arm has besides.",
            callback=file_of("a scenario.toml"),
        ),
    ] = None,
    trajectory: Annotated[
        Path | None,
        typer.Option(
            help="What to drive.",
            show_default="the accepted one, else a new plan",
            callback=file_of("a trajectory"),
        ),
    ] = None,
    cell: CellOption = None,
    duration: Annotated[float, typer.Option(min=2.0, max=120.0, help="Of a new plan, s.")] = 12.0,
    evaluations: Annotated[int, typer.Option(min=100, help="Trials of a new plan's search.")] = 6000,
    celsius: Celsius = None,
    tolerance: Annotated[
        float, typer.Option(min=0.001, max=1.0, help="Share of a joint's torque that may change.")
    ] = 0.05,
    false_alarms: Annotated[float, typer.Option(min=0.01, max=50.0, help="Allowed per arm and year.")] = 0.5,
    per_year: Annotated[float, typer.Option(min=1.0, max=9000.0, help="Checks in a year.")] = 365.0,
    search: Annotated[
        bool, typer.Option("--search", help="Look for a new effect where nothing known explains a change.")
    ] = False,
    stands_at: StandsAt = None,
    new_arm: NewArm = False,
    at_once: Annotated[int, typer.Option(min=1, help="Streams at the same time, with --all.")] = 1,
    jobs: Annotated[int, typer.Option(min=1, help="Processes that identify, with --all.")] = 2,
    backend: Annotated[str, typer.Option(help="Of joblib, with --all: loky, sequential, dask.")] = "loky",
    notify: Annotated[
        Path | None,
        typer.Option(
            help="notify.toml: who is told of a new verdict.",
            show_default="the user's",
            callback=file_of("who is told (notify.toml)"),
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder.", show_default="runs/<time>-check-<robot>")
    ] = None,
    quiet: Quiet = False,
    parameters: Parameters = False,
    as_json: Json = False,
) -> int:
    """Identify an arm again, compare it with its baseline, and say what has moved. Nagios exit codes.

    Example: [bold]armhil check tx40 --simulated[/]
    """
    from daq.check.errors import CheckError

    if everyone == (robot is not None):
        raise CheckError("give one ROBOT, or --all for the fleet")
    refuse_given(context, OF_ONE_ARM if everyone else OF_A_FLEET, everyone)
    if not everyone and not simulated and (scenario is not None or noise_seed is not None):
        raise CheckError("--scenario and --noise-seed are of simulated drives; give --simulated")
    from daq.catalogue.database import Catalogue
    from daq.check.check import run_check
    from daq.check.check_json import check_json
    from daq.check.fleet import read_fleet
    from daq.check.fleet_run import check_fleet
    from daq.check.request import CheckRequest
    from daq.check.terminal import print_check, print_fleet
    from daq.files.run_folder import make_run_folder
    from daq.notify.notify import notify_of
    from daq.notify.settings import read_notify
    from daq.session.cell import cell_of
    from daq.session.recorded_runs import unconducted
    from ident.drift import DriftSettings

    settings = DriftSettings(
        false_alarms_per_year=false_alarms, nights_per_year=per_year, tolerance=tolerance
    )
    console = console_of(as_json)
    if notify is not None:
        read_notify(notify)  # a mistake in it is told before anything moves
    with Catalogue() as catalogue:
        if everyone:
            done = check_fleet(
                read_fleet(fleet),
                catalogue,
                out,
                settings,
                celsius,
                at_once=at_once,
                jobs=jobs,
                backend=backend,
                duration=duration,
                evaluations=evaluations,
                search=search,
            )
            tell_of(done.results, catalogue, notify)
            if as_json:
                print_json(done.as_json())
            print_fleet(console, done)
            return done.exit_code
        assert robot is not None
        order = replace(
            arm_order_of(
                robot,
                interface,
                channel,
                simulated=simulated,
                seed=seed,
                new_arm=new_arm,
                stands_at=stands_at,
            ),
            noise_seed=noise_seed,
            scenario=scenario,
        )
        request = CheckRequest(
            order,
            make_run_folder(out, f"check-{order.robot.name}"),
            catalogue,
            trajectory,
            duration,
            evaluations,
            celsius,
            search,
            settings,
            cell_of(cell),
        )
        watcher = watcher_of(console, order.robot, quiet)
        result = run_check(request, steps_of(console, quiet), watcher, unconducted)
        for warning in result.warnings:
            say(f"WARNING: {warning}")
        notify_of(result, catalogue, notify)
    if as_json:
        print_json(check_json(result))
    print_check(console, result, parameters)
    return result.verdict.exit_code


def tell_of(results: Sequence[CheckResult], catalogue: Catalogue, notify: Path | None) -> None:
    """Warn of each arm and have somebody told; one that nobody can be told of keeps no other back."""
    from daq.check.analysis import attempted
    from daq.notify.notify import notify_of

    for result in results:
        for warning in result.warnings:
            say(f"WARNING: {result.arm}: {warning}")
        told = attempted(partial(notify_of, result, catalogue, notify))
        if isinstance(told, Exception):
            say(f"WARNING: {result.arm}: nobody was told: {told}")


def refuse_given(context: typer.Context, names: tuple[str, ...], everyone: bool) -> None:
    """Was an option given that would be ignored?

    Raises:
        CheckError: names the first one.
    """
    from daq.check.errors import CheckError

    for name in names:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            where = "not with --all; fleet.toml says it for each arm" if everyone else "only with --all"
            raise CheckError(f"--{name.replace('_', '-')}: {where}")
