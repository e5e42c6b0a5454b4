"""Options of a log that is read with a URDF alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

UrdfOfLog = Annotated[
    Path | None,
    typer.Option("--urdf", help="The log's arm: columns, units and settings are guessed and shown."),
]
SampleRate = Annotated[
    float | None,
    typer.Option("--sample-rate", min=0.1, help="Samples per second.", show_default="a column's"),
]
RatioOfLog = Annotated[
    str | None,
    typer.Option("--ratio", help="Motor turns per joint turn: n numbers, comma.", show_default="guessed"),
]
GainOfLog = Annotated[
    str | None,
    typer.Option("--gain", help="Torque per unit of current: n numbers, comma.", show_default="guessed"),
]
OffsetOfLog = Annotated[
    str | None,
    typer.Option("--offset", help="Added to joint positions, rad or m: n numbers.", show_default="guessed"),
]
PayloadsOfLogs = Annotated[
    list[str] | None,
    typer.Option(
        "--payload", help="LOG=payload.toml: the known body that LOG was recorded with; may be repeated."
    ),
]
TorqueSensors = Annotated[bool, typer.Option("--torque-sensors", help="Torques are of sensors at the links.")]
SaveMap = Annotated[Path | None, typer.Option("--save-map", help="Keep the guessed column map here.")]
SaveRobot = Annotated[
    Path | None, typer.Option("--save-robot", help="Folder for the guessed robot.toml with URDF and map.")
]


def guess_request_of(
    urdf: Path | None,
    robot: str | None,
    sample_rate: float | None,
    numbers: dict[str, str | None],
    torque_sensors: bool,
    save_map: Path | None,
    save_robot: Path | None,
) -> Any:
    """What is to be guessed of a log; None where its arm is described.

    Raises:
        CaptureError: options that do not go together, or numbers that are none.
    """
    from daq.importing.guess_log import GuessRequest
    from daq.importing.guess_torque import LogHints
    from daq.recording.errors import CaptureError

    given = [f"--{name}" for name, text in numbers.items() if text is not None]
    given += ["--sample-rate"] * (sample_rate is not None) + ["--torque-sensors"] * torque_sensors
    given += ["--save-map"] * (save_map is not None) + ["--save-robot"] * (save_robot is not None)
    if urdf is None:
        if given:
            raise CaptureError(f"{given[0]} is for logs that are read with --urdf; allowed: with --urdf")
        return None
    if robot is not None:
        raise CaptureError("--robot and --urdf both say which arm it is; allowed: one of them")
    if not urdf.is_file():
        raise CaptureError(f"--urdf {urdf}: no such file; allowed: the URDF of the log's arm")
    values = {name: _numbers(name, text) for name, text in numbers.items()}
    hints = LogHints(sample_rate, **values, sensor=torque_sensors)
    return GuessRequest(urdf, hints, save_map, save_robot)


def _numbers(name: str, text: str | None) -> tuple[float, ...]:
    from math import isfinite

    from daq.recording.errors import CaptureError

    if text is None:
        return ()
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = (float("nan"),)
    if not all(isfinite(value) for value in values) or (name != "offset" and 0.0 in values):
        raise CaptureError(f"--{name} {text}: allowed: numbers with commas between them, one per joint")
    return values
