"""The command line: it parses, calls and prints; the work is done elsewhere.

Modules that take long to import are imported inside the commands, so that help is quick.
"""

from __future__ import annotations

import importlib.metadata
import json
import logging
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.exceptions import TyperException

app = typer.Typer(
    name="armhil",
    help="Identify the dynamic model of a robot arm over CAN, and say whether the model can be trusted.",
    epilog="Example: [bold]armhil demo[/]",
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

OK, WARNING, FAILED, UNKNOWN, INTERRUPTED = 0, 1, 2, 3, 130

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout; text goes to stderr.")]
RobotName = Annotated[
    str, typer.Option("--robot", help="A shipped arm (see `armhil robots`) or a robot.toml.")
]
Out = Annotated[
    Path | None, typer.Option("--out", help="Folder for the results.", show_default="runs/<time>-<robot>")
]


def main() -> None:
    """Run the command line; a user's mistake ends in one line and exit code 2, never in a traceback."""
    for library in ("OMP", "OPENBLAS", "MKL"):
        # Many small solves run faster on one thread. Before anything imports numpy.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    debug = os.environ.get("ARMHIL_DEBUG", "") not in ("", "0")
    try:
        code = app(sys.argv[1:] or ["--help"], standalone_mode=False)
    except SystemExit:
        # So Typer leaves where the reader of a pipe has gone; nobody is there to be told.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(OK)
    except typer.Abort:
        code = INTERRUPTED
    except TyperException as error:
        _say(error.format_message())
        sys.exit(FAILED)
    except _interruptions() as error:
        _say(str(error))
        sys.exit(INTERRUPTED)
    except _user_errors() as error:
        if debug:
            raise
        _say(" ".join(str(error).split()))
        sys.exit(FAILED)
    if code == INTERRUPTED:
        _say("interrupted")  # Typer makes this code of a KeyboardInterrupt
    sys.exit(code if isinstance(code, int) else OK)


def _interruptions() -> tuple[type[Exception], ...]:
    """A stop on request. Imported only once there is an exception to compare with."""
    from daq.demo import RunInterrupted

    return (RunInterrupted,)


def _user_errors() -> tuple[type[Exception], ...]:
    """What a user can cause; each says in one line what is wrong and what is allowed."""
    from daq.capture import CaptureError
    from daq.cell_file import CellFileError
    from daq.demo import RunFailed
    from daq.model_file import ModelFileError
    from daq.report import ReportError
    from daq.run_folder import OutputError
    from daq.testing import NoTests
    from daq.trajectory_file import TrajectoryFileError
    from drivers import BusError, DriveError
    from ident import IdentificationError
    from robots import RobotFileError
    from trajectories import PlanError, TrajectoryError

    return (
        BusError,
        CaptureError,
        CellFileError,
        DriveError,
        IdentificationError,
        ModelFileError,
        NoTests,
        OSError,
        OutputError,
        PlanError,
        ReportError,
        RobotFileError,
        RunFailed,
        TrajectoryError,
        TrajectoryFileError,
    )


def _say(text: str) -> None:
    sys.stderr.write(f"armhil: {text}\n")


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"armhil {importlib.metadata.version('armhil')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log what is done to stderr.")] = False,
) -> None:
    """Options of every command."""
    logging.basicConfig(
        level=logging.INFO if verbose else logging.ERROR,
        format="%(levelname)s %(name)s: %(message)s",
        stream=sys.stderr,
    )
    if not verbose:
        # What goes wrong on the bus is told by the exception that comes of it, in one line.
        for library in ("can", "canopen"):
            logging.getLogger(library).setLevel(logging.CRITICAL)


@app.command()
def demo(
    robot: RobotName = "tx40",
    interface: Annotated[
        str | None, typer.Option(help="python-can interface.", show_default="the robot's")
    ] = None,
    channel: Annotated[str | None, typer.Option(help="Channel on it.", show_default="the robot's")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated arm, its noise and the trajectory.")] = 0,
    out: Out = None,
    duration: Annotated[float, typer.Option(min=2.0, max=120.0, help="One period of the motion, s.")] = 12.0,
    periods: Annotated[int, typer.Option(min=1, max=100, help="How often it is repeated.")] = 2,
    evaluations: Annotated[int, typer.Option(min=100, help="Trials of the trajectory search.")] = 6000,
    as_json: Json = False,
) -> int:
    """Run the whole chain on simulated drives: plan, stream, record, identify, test, report.

    Example: [bold]armhil demo --robot tx40 --seed 3 --out runs/first[/]
    """
    import robots
    from daq.demo import DemoRequest, run_demo
    from daq.identification_json import identification_json
    from daq.run_folder import make_run_folder
    from daq.terminal import TerminalSteps, print_identification
    from drivers import Channel

    arm = robots.load(robot)
    bus = Channel(
        arm.bus.interface if interface is None else interface, arm.bus.channel if channel is None else channel
    )
    folder = make_run_folder(out, arm.name)
    request = DemoRequest(arm, robot, bus, seed, folder, duration, periods, evaluations)
    console = _console(as_json)
    result = run_demo(request, TerminalSteps(console))
    if as_json:
        _print_json(identification_json(result.fitted.result, [str(result.capture.path)], result.truth))
    print_identification(console, result.fitted.result, result.truth)
    console.print(f"\nReport: [bold]{result.report}[/]", soft_wrap=True, highlight=False)
    return _code_of(result.fitted.result.test.verdict)


@app.command()
def identify(
    paths: Annotated[
        list[Path], typer.Argument(help="Captures (.mcap), or logs that a column map describes.")
    ],
    robot: Annotated[
        str | None,
        typer.Option("--robot", help="A shipped arm or a robot.toml.", show_default="the capture's own"),
    ] = None,
    columns: Annotated[
        Path | None, typer.Option(help="Column map of a log.", show_default="the robot's")
    ] = None,
    validate: Annotated[
        list[Path] | None, typer.Option(help="A recording to predict and not to fit to; may be repeated.")
    ] = None,
    method: Annotated[str, typer.Option(help="auto, ls, iv or robust.")] = "auto",
    covariance: Annotated[
        str | None,
        typer.Option(help="iid, block, ar, hc, hac, cluster or bootstrap.", show_default="settings"),
    ] = None,
    friction: Annotated[
        str | None, typer.Option(help="symmetric or asymmetric.", show_default="settings")
    ] = None,
    essential: Annotated[
        bool, typer.Option("--essential", help="Find the essential parameters by F-tests.")
    ] = False,
    cutoff: Annotated[
        str | None,
        typer.Option(help="Low-pass for q: Hz, or auto for the proposed one.", show_default="settings"),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(min=0.1, help="Rows per second after decimation.", show_default="settings")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for report and model file.")] = None,
    as_json: Json = False,
) -> int:
    """Identify an arm from recordings and say whether the model can be trusted.

    Example: [bold]armhil identify runs/first/capture.mcap --out runs/again[/]
    """
    from daq.identification_json import identification_json
    from daq.identify import IdentifyRequest, run_identify
    from daq.identify_options import cutoff_of, method_of
    from daq.terminal import TerminalSteps, print_identification

    console = _console(as_json)
    request = IdentifyRequest(
        tuple(paths),
        robot,
        columns,
        cutoff_of(cutoff),
        rate,
        out,
        method=method_of(method),
        covariance=covariance,
        friction=friction,
        validate=tuple(validate or ()),
        essential=essential,
    )
    result = run_identify(request, TerminalSteps(console))
    if as_json:
        _print_json(identification_json(result.fitted.result, [str(path) for path in paths]))
    print_identification(console, result.fitted.result)
    if result.report is not None:
        console.print(f"\nReport: [bold]{result.report}[/]", soft_wrap=True, highlight=False)
    return _code_of(result.fitted.result.test.verdict)


@app.command()
def plan(
    robot: Annotated[str, typer.Argument(help="A shipped arm (see `armhil robots`) or a robot.toml.")],
    check: Annotated[
        Path | None, typer.Option(help="Judge this trajectory (.json, .csv, .mcap) instead of planning one.")
    ] = None,
    objective: Annotated[
        str, typer.Option(help="determinant, trace or condition: what is minimised.")
    ] = "determinant",
    parameters: Annotated[
        str | None, typer.Option(help="Only these: payload, friction4, joint2, ZZ1R, …", show_default="all")
    ] = None,
    family: Annotated[str, typer.Option(help="ruckig or fourier.")] = "ruckig",
    duration: Annotated[float, typer.Option(min=0.1, max=600.0, help="One period of the motion, s.")] = 12.0,
    periods: Annotated[int, typer.Option(min=1, max=100, help="How often it is repeated.")] = 1,
    speed: Annotated[float, typer.Option(help="The same path slower, e.g. 0.1 for a first run.")] = 1.0,
    start: Annotated[
        str | None, typer.Option(help="Where the arm stands: n positions, comma.", show_default="home")
    ] = None,
    cell: Annotated[Path | None, typer.Option(help="cell.toml: floor, obstacles, tool.")] = None,
    floor: Annotated[float | None, typer.Option(help="Height of a floor, m.", show_default="none")] = None,
    tool_speed: Annotated[
        float | None, typer.Option(help="Highest speed of the tool, m/s.", show_default="none")
    ] = None,
    earlier: Annotated[
        Path | None, typer.Option(help="An earlier capture or model of the arm: errors and values to expect.")
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
    as_json: Json = False,
) -> int:
    """Plan an exciting trajectory, or judge any trajectory, before anything moves.

    Example: [bold]armhil plan tx40 --seed 1 --out runs/plan[/]
    """
    import robots
    from daq.plan import PlanRequest, run_plan
    from daq.plan_json import plan_json
    from daq.plan_options import criterion_of, family_of, posture_of, words_of
    from daq.plan_terminal import print_plan
    from daq.terminal import TerminalSteps

    console = _console(as_json)
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
    )
    result = run_plan(request, TerminalSteps(console))
    if as_json:
        _print_json(plan_json(result))
    print_plan(console, result)
    return {"fine": OK, "weak": WARNING, "refused": FAILED, "unmeasurable": UNKNOWN}[result.verdict]


@app.command()
def diagnose(
    paths: Annotated[list[Path], typer.Argument(help="Captures or logs to find the missing effect on.")],
    validate: Annotated[
        list[Path] | None, typer.Option("--validate", help="Captures or logs to show the gap on.")
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option("--robot", help="A shipped arm or a robot.toml.", show_default="the capture's own"),
    ] = None,
    columns: Annotated[
        Path | None, typer.Option(help="Column map of a log.", show_default="the robot's")
    ] = None,
    split_half: Annotated[
        bool, typer.Option("--split-half", help="Validate on the second half of each record.")
    ] = False,
    without: Annotated[
        list[str] | None, typer.Option("--without", help="An effect to leave out of the model.")
    ] = None,
    prior: Annotated[
        str | None, typer.Option(help="An accepted model file, or cad.", show_default="after a refit")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for page, result and model file.")] = None,
    as_json: Json = False,
) -> int:
    """Find what the model lacks, name it, add it, and show the gap shrink on data that was not fitted.

    Example: [bold]armhil diagnose runs/a/capture.mcap --validate runs/b/capture.mcap --out runs/why[/]
    """
    from daq.diagnose import DiagnoseRequest, run_diagnose
    from daq.diagnosis_json import diagnosis_json
    from daq.diagnosis_terminal import print_diagnosis
    from daq.terminal import TerminalSteps

    console = _console(as_json)
    fit, held = tuple(paths), tuple(validate or ())
    request = DiagnoseRequest(fit, held, robot, columns, split_half, tuple(without or ()), prior, out)
    result = run_diagnose(request, TerminalSteps(console))
    if as_json:
        names = [[str(path) for path in group] for group in (fit, held or fit)]
        _print_json(diagnosis_json(result.diagnosis, result.robot.name, *names))
    print_diagnosis(console, result.diagnosis)
    if result.folder is not None:
        page = result.folder / "diagnosis.html"
        console.print(f"\nPage: [bold]{page}[/]", soft_wrap=True, highlight=False)
    return OK if result.diagnosis.verdict == "clean" else WARNING


@app.command()
def robots() -> None:
    """List the arms that ship.

    Example: [bold]armhil robots[/]
    """
    import robots as shipped_robots

    for name in shipped_robots.shipped():
        arm = shipped_robots.load(name)
        typer.echo(f"{name:8} {arm.n} joints  {arm.description}")


@app.command()
def doctor(
    robot: Annotated[str, typer.Argument(help="A shipped arm (see `armhil robots`) or a robot.toml.")],
    interface: Annotated[
        str | None, typer.Option(help="python-can interface.", show_default="the robot's")
    ] = None,
    channel: Annotated[str | None, typer.Option(help="Channel on it.", show_default="the robot's")] = None,
    as_json: Json = False,
) -> int:
    """Is this machine fit to drive this arm? Each check with what to do about it; nothing moves.

    Example: [bold]armhil doctor tx40[/]
    """
    import robots
    from daq.doctor import CODES, describe, doctor_json, examine, worst

    arm = robots.load(robot)
    bus = _bus_of(arm, interface, channel)
    checks = examine(arm, bus)
    if as_json:
        _print_json(doctor_json(arm, bus, checks))
    _console(as_json).print(describe(checks), highlight=False, markup=False, soft_wrap=True)
    return CODES[worst(checks)]


@app.command()
def sim(
    robot: Annotated[str, typer.Argument(help="A shipped arm (see `armhil robots`) or a robot.toml.")],
    interface: Annotated[
        str | None, typer.Option(help="python-can interface.", show_default="the robot's")
    ] = None,
    channel: Annotated[str | None, typer.Option(help="Channel on it.", show_default="the robot's")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated arm and its noise.")] = 0,
) -> None:
    """Run the simulated drives alone, as a bench for anyone's master; Ctrl-C ends them.

    Example: [bold]armhil sim tx40 --interface socketcan --channel vcan0[/]
    """
    import robots
    from daq.sim import run_simulation

    run_simulation(robot, _bus_of(robots.load(robot), interface, channel), seed, typer.echo)


@app.command(
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
)
def test(context: typer.Context) -> int:
    """Run the tests of a clone with pytest; what follows goes to pytest.

    Example: [bold]armhil test -k emps -x[/]
    """
    from daq.testing import run_tests

    return run_tests(Path.cwd(), context.args)


def _code_of(verdict: str) -> int:
    """A model that must not be trusted is a warning to whoever calls this from a script."""
    return WARNING if verdict == "instruments_invalid" else OK


def _bus_of(arm: Any, interface: str | None, channel: str | None) -> Any:
    """The bus that was asked for, else the arm's own."""
    from drivers import Channel

    return Channel(
        arm.bus.interface if interface is None else interface, arm.bus.channel if channel is None else channel
    )


def _console(as_json: bool) -> Any:
    """Where a person reads: stdout, or stderr when stdout carries JSON."""
    from rich.console import Console

    return Console(stderr=as_json)


def _print_json(content: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    sys.stdout.flush()
