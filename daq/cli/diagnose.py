"""`armhil diagnose`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from daq.cli.app import app
from daq.cli.common import (
    CELL_FILE,
    OK,
    UNKNOWN,
    WARNING,
    Columns,
    Json,
    NewArm,
    NoCatalogue,
    NotCommissioned,
    Parameters,
    Quiet,
    RobotOfRecording,
    Simulated,
    SimulatedSeed,
    StandsAt,
    arm_order_of,
    asking,
    catalogue_of,
    console_of,
    file_of,
    found,
    print_json,
    steps_of,
    there,
    watcher_of,
)
from daq.cli.log_options import (
    GainOfLog,
    OffsetOfLog,
    PayloadsOfLogs,
    RatioOfLog,
    SampleRate,
    SaveMap,
    SaveRobot,
    TorqueSensors,
    UrdfOfLog,
    guess_request_of,
)

_EXIT_CODES = {"clean": OK, "not_confirmed": UNKNOWN}
"""By verdict; a warning where there is something else to say."""


@app.command()
def diagnose(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(help="Captures or logs to find the missing effect on.", callback=there),
    ] = None,
    validate: Annotated[
        list[Path] | None,
        typer.Option("--validate", help="Captures or logs to show the gap on.", callback=there),
    ] = None,
    robot: RobotOfRecording = None,
    columns: Columns = None,
    split_half: Annotated[
        bool, typer.Option("--split-half", help="Validate on the second half of each record.")
    ] = False,
    without: Annotated[
        list[str] | None, typer.Option("--without", help="An effect to leave out of the model.")
    ] = None,
    prior: Annotated[
        str | None, typer.Option(help="An accepted model file, or cad.", show_default="after a refit")
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(
            help="cell.toml: what a planned motion has to keep clear of.",
            callback=file_of(CELL_FILE),
        ),
    ] = None,
    live: Annotated[
        str | None,
        typer.Option(
            "--live",
            help="The arm on its bench: record, and settle what is ambiguous.",
            callback=found,
        ),
    ] = None,
    interface: Annotated[
        str | None, typer.Option(help="python-can interface, with --live.", show_default="the robot's")
    ] = None,
    channel: Annotated[
        str | None, typer.Option(help="Channel on it, with --live.", show_default="the robot's")
    ] = None,
    simulated: Simulated = False,
    seed: SimulatedSeed = 0,
    stands_at: StandsAt = None,
    new_arm: NewArm = False,
    not_commissioned: NotCommissioned = False,
    yes: Annotated[bool, typer.Option("--yes", help="Allow the motions of --live without asking.")] = False,
    rounds: Annotated[int, typer.Option(min=0, help="Motions of --live to tell candidates apart.")] = 2,
    duration: Annotated[
        float, typer.Option(min=2.0, max=120.0, help="One period of what --live records first, s.")
    ] = 12.0,
    evaluations: Annotated[
        int, typer.Option(min=0, help="Trials of the search for a motion; 0 plans none.")
    ] = 1500,
    power: Annotated[
        bool, typer.Option("--power", help="How small each effect would still have been named.")
    ] = False,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for page, result and model file.")] = None,
    payload: PayloadsOfLogs = None,
    urdf: UrdfOfLog = None,
    sample_rate: SampleRate = None,
    ratio: RatioOfLog = None,
    gain: GainOfLog = None,
    offset: OffsetOfLog = None,
    torque_sensors: TorqueSensors = False,
    save_map: SaveMap = None,
    save_robot: SaveRobot = None,
    no_catalogue: NoCatalogue = False,
    quiet: Quiet = False,
    parameters: Parameters = False,
    as_json: Json = False,
) -> int:
    """Find what the model lacks, name it, add it, and show the gap shrink on data that was not fitted.

    Example: [bold]armhil diagnose runs/a/capture.mcap --validate runs/b/capture.mcap --out runs/why[/]
    A log of any arm: [bold]armhil diagnose log.csv --split-half --urdf arm.urdf[/]
    """
    from daq.recording.errors import CaptureError
    from robots.free_memory import for_good, one_heap

    if live is None and not paths:
        raise CaptureError("no recording; allowed: captures or logs, or --live with the arm on its bench")
    one_heap()
    with for_good():
        from daq.diagnosis.diagnose import run_diagnose
        from daq.diagnosis.diagnose_result import DiagnoseRequest
        from daq.diagnosis.diagnosis_terminal import print_diagnosis
        from daq.diagnosis.evidence import print_evidence
        from daq.diagnosis.more import print_more
        from daq.files.model_file import SUFFIX
        from daq.identification.carried import carried_of
        from daq.identification.terminal import print_guessed
        from daq.session.cell import cell_of
        from daq.text.wrapped import write

    guess = guess_request_of(
        urdf,
        robot if live is None else live,
        sample_rate,
        {"ratio": ratio, "gain": gain, "offset": offset},
        torque_sensors,
        save_map,
        save_robot,
    )
    console = console_of(as_json)
    request = DiagnoseRequest(
        tuple(paths or ()),
        tuple(validate or ()),
        robot if live is None else live,
        columns,
        split_half,
        tuple(without or ()),
        prior,
        out,
        cell,
        evaluations,
        power=power,
        guess=guess,
        carried=carried_of(payload or ()),
    )
    catalogue = catalogue_of(no_catalogue or (out is None and live is None))
    if live is None:
        result = run_diagnose(request, steps_of(console, quiet))
        content = result.content
    else:
        order = arm_order_of(
            live,
            interface,
            channel,
            simulated=simulated,
            seed=seed,
            new_arm=new_arm,
            stands_at=stands_at,
            not_commissioned=not_commissioned,
            as_json=as_json,
        )
        confirm = asking(yes, simulated, as_json)
        found = _live(request, order, cell_of(cell), catalogue, confirm, console, rounds, duration, quiet)
        more = {
            "recorded": [str(path) for path in found.recorded],
            "rounds": len(found.results) - 1,
            "refused": found.refused or None,
        }
        result, content, request = found.last, found.last.content | {"live": more}, found.request
    if catalogue is not None:
        from daq.keeping.keep import keep_diagnose_request

        keep_diagnose_request(catalogue, request, result)
    if as_json:
        print_json(content)
    model = None if result.folder is None else result.folder / f"{result.robot.name}{SUFFIX}"
    print_guessed(console, result.guessed)
    apart, blind = result.apart, result.blind
    print_diagnosis(console, result.diagnosis, result.series.checks, apart, blind, model, parameters)
    for sentence in result.carried:
        write(console, f"- {sentence}.", indent="  ")
    print_more(console, result.more)
    if parameters:
        print_evidence(console, result.evidence)
    if not parameters:
        write(console, "- Parameters of the findings, rankings and gaps: --parameters.", style="dim")
    if result.folder is not None:
        page = result.folder / "diagnosis.html"
        write(console, f"\nPage: {page}")
    return _EXIT_CODES.get(result.diagnosis.verdict, WARNING)


def _live(
    request: Any,
    order: Any,
    cell: Any,
    catalogue: Any,
    confirm: Any,
    console: Any,
    rounds: int,
    duration: float,
    quiet: bool,
) -> Any:
    """The diagnosis with the arm in the loop."""
    from daq.diagnosis.bench import LiveArm
    from daq.diagnosis.live import LiveRequest, live_folder, run_live
    from daq.session.bench import opened
    from daq.session.keyboard import by_keyboard
    from daq.text.wrapped import write

    steps, watcher = steps_of(console, quiet), watcher_of(console, order.robot, quiet)
    folder = live_folder(request.out, order.robot)
    live = LiveRequest(request, order.robot, folder, rounds=rounds, duration=duration)
    with opened(order, catalogue, steps, "drive", cell) as arm:
        drive = LiveArm(arm, order, catalogue, cell, confirm, watcher, by_keyboard).drive
        found = run_live(live, drive, steps)
    if found.refused:
        write(console, f"No motion without leave ({found.refused}); --yes allows it")
    return found
