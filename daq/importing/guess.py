"""Guess from names and sizes what the columns of a log mean, as a column map for a person to look over."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from daq.files.toml_text import toml_text
from daq.importing.channels import channels_of
from daq.importing.columns import Table, read_table
from daq.importing.guess_which import position_of, present, time_of, torques_of
from daq.recording.errors import CaptureError
from robots import Robot

_DEGREES = 2 * np.pi * 1.5
"""Above it, angles are hardly radians."""


def guess_map(source: Path, robot: Robot) -> dict[str, Any]:
    """A column map as plain tables, of names and sizes; with a URDF, ``guess_log`` proves it on the data.

    Args:
        source: a file with named columns, or a folder with a ROS 2 bag.
        robot: the arm; columns are looked for by its joints' names and their number.

    Raises:
        CaptureError: the file cannot be read, or nothing in it looks like positions and torques.
    """
    table = read_table(source)
    channels = channels_of(table.columns, [joint.name for joint in robot.joint])
    groups = [c for c in channels if len(c.columns) == robot.n]
    try:
        position = position_of(source, groups, robot.n)
        torque = torques_of(source, [c for c in groups if c is not position])[0]
    except CaptureError as error:
        raise CaptureError(f"{error}; or write a column map by hand") from None
    same = [c for c in channels if len(c.values) == len(position.values)]
    topic = position.columns[0].rsplit("/", 2)[0] if "/" in position.columns[0] else ""
    same.sort(key=lambda c: not topic or c.columns != (f"{topic}/stamp",))
    try:
        _, time, _ = time_of(source, same, len(position.values), None)
    except CaptureError:
        raise CaptureError(
            f"{source}: no column looks like time; write a column map by hand, with sample_rate_hz where"
            f" there is none; {present(channels)}"
        ) from None
    found: dict[str, Any] = {"format": 1, "time": time}
    references = [c for c in groups if c.kind in ("position", "") and "reference" in c.marks]
    for kind, channel in (("position", position), *(("reference", c) for c in references[:1])):
        found[kind] = {
            "columns": list(channel.columns),
            "unit": _position_unit(table, channel.columns, robot),
        }
    unit = {"unit": "N*m"} if torque.kind == "torque" else {}
    found["torque" if unit else "control_signal"] = {"columns": list(torque.columns), **unit}
    return found


def _position_unit(table: Table, columns: tuple[str, ...], robot: Robot) -> str:
    """By the joints' limits: what leaves them by far as radians and not as degrees is degrees."""
    values = np.abs(table.pick(columns)).max(axis=0)
    limits = np.maximum(np.abs(robot.lower), np.abs(robot.upper))
    small, large = ("m", "mm") if robot.joint[0].kind == "prismatic" else ("rad", "deg")
    return large if (values > np.maximum(1.5 * limits, 0.0)).any() and values.max() > _scale(large) else small


def _scale(unit: str) -> float:
    return _DEGREES if unit == "deg" else 5.0


def write_map(path: Path, found: dict[str, Any], source: Path) -> None:
    """Write a guessed map, with a line that says where it is from.

    Raises:
        CaptureError: the file exists or cannot be written.
    """
    text = (
        f"# Guessed from {source.name}: look it over. Sides, gear ratios and units cannot be seen in names.\n"
    )
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text + toml_text(found))
    except FileExistsError:
        raise CaptureError(f"{path}: exists already; use it with --columns, or choose another name") from None
    except OSError as error:
        raise CaptureError(f"{path}: cannot be written: {error.strerror}") from error
