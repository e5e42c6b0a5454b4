"""`armhil import`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.app import app
from daq.cli.common import OK, WARNING, Json, console_of, file_of, found, print_json
from daq.cli.log_options import (
    GainOfLog,
    OffsetOfLog,
    RatioOfLog,
    SampleRate,
    SaveRobot,
    TorqueSensors,
    UrdfOfLog,
    guess_request_of,
)


@app.command("import")
def import_(
    file: Annotated[
        Path,
        typer.Argument(
            help="A log: .csv, .mat, .parquet, .mcap, .db3, or a folder.",
            callback=file_of("a log, or a folder"),
        ),
    ],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot", help="A shipped arm or a robot.toml.", show_default="with --urdf", callback=found
        ),
    ] = None,
    columns: Annotated[
        Path | None, typer.Option(help="Column map of the log.", show_default="the robot's")
    ] = None,
    save_map: Annotated[
        Path | None, typer.Option("--save-map", help="Guess the column map, save it here, and use it.")
    ] = None,
    urdf: UrdfOfLog = None,
    sample_rate: SampleRate = None,
    ratio: RatioOfLog = None,
    gain: GainOfLog = None,
    offset: OffsetOfLog = None,
    torque_sensors: TorqueSensors = False,
    save_robot: SaveRobot = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="The new capture.", show_default="<file>.capture.mcap")
    ] = None,
    note: Annotated[
        str | None, typer.Option(help="What to remember of this log.", show_default="none")
    ] = None,
    as_json: Json = False,
) -> int:
    """Make a capture of a log that armhil did not record; a column map says what its columns are.

    Example: [bold]armhil import DATA_EMPS.mat --robot emps --out emps.mcap[/]
    A log of any arm: [bold]armhil import log.csv --urdf arm.urdf[/]
    """
    from contextlib import ExitStack

    import robots
    from daq.files.toml_text import toml_text
    from daq.identification.terminal import print_guessed
    from daq.importing.guess import guess_map, write_map
    from daq.importing.guess_log import guessed_arm
    from daq.importing.load import MAP_NAME
    from daq.importing.log_import import SUFFIX, import_json, import_log
    from daq.recording.capture import CaptureError

    if columns is not None and save_map is not None:
        raise CaptureError("--columns names a map that exists and --save-map makes one; allowed: one of both")
    if columns is not None and urdf is not None:
        raise CaptureError("--urdf guesses the columns and --columns names them; allowed: one of both")
    guess = guess_request_of(
        urdf,
        robot,
        sample_rate,
        {"ratio": ratio, "gain": gain, "offset": offset},
        torque_sensors,
        None if urdf is None else save_map,
        save_robot,
    )
    console = console_of(as_json)
    target = out if out is not None else file.with_name(file.stem + SUFFIX)
    with ExitStack() as stack:
        if guess is not None:
            read = stack.enter_context(guessed_arm(file, guess))
            arm, map_path = read.robot, read.robot.folder / MAP_NAME
            print_guessed(console, read.words)
        elif robot is not None:
            arm = robots.load(robot)
            map_path = columns or save_map or arm.folder / MAP_NAME
        else:
            raise CaptureError("no arm; allowed: --urdf of the log's arm, or --robot that describes it")
        if save_map is not None and guess is None:
            guessed = guess_map(file, arm)
            write_map(save_map, guessed, file)
            console.print(f"Guessed, in {save_map}:", markup=False, highlight=False)
            console.print(toml_text(guessed), markup=False, highlight=False, soft_wrap=True)
        imported = import_log(file, arm, map_path, target, note or "")
    if as_json:
        print_json(import_json(imported))
    capture = imported.capture
    for line in (
        f"{capture.path}: {len(capture.samples)} samples of {arm.name}, {1e3 * capture.period:g} ms apart",
        *(f"warning: {sentence}" for sentence in imported.warnings),
    ):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    return WARNING if imported.warnings else OK
