"""The groups of columns of a log: of one file, or of the tables in a folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from daq.importing.bags import is_bag_folder
from daq.importing.channels import Channels, channels_of
from daq.importing.columns import TEXTS, read_table, vector_by_vector
from daq.importing.guess_position import counts_of_joints
from daq.importing.guess_torque import LogHints
from daq.importing.unnamed import told_apart
from daq.recording.errors import CaptureError
from robots.arrays import FloatArray
from robots.loose_urdf import LooseUrdf

_MOST = 600_000
"""Samples that guesses are proven on: ten minutes at 1 kHz."""
_SAYING = {"position", "velocity", "torque", "current"}
"""Kinds of which a log with names has one."""


def channels_of_log(path: Path, arm: LooseUrdf, hints: LogHints) -> tuple[list[Channels], list[str]]:
    """All groups of columns of a file, or of the .csv files in a folder; and what told unnamed ones.

    Raises:
        CaptureError: it cannot be read, or has unnamed columns that nothing tells apart.
    """
    if not path.exists():
        raise CaptureError(f"{path}: no such file")
    joints = [joint.name for joint in arm.moving]
    if not path.is_dir() or is_bag_folder(path):
        columns = _part(read_table(path).columns)
        found = channels_of(columns, joints)
        if any(channel.kind in _SAYING for channel in found):
            return found, []
        return told_apart(path, columns, arm, hints)
    tables = _tables(path)
    lengths = {len(values) for columns in tables.values() for values in columns.values()}
    for name, columns in tables.items():
        for column, values in columns.items() if len(columns) == 1 else ():
            counts = [n for n in counts_of_joints(arm) if n > 1 and len(values) / n in lengths]
            tables[name] = (counts and vector_by_vector(column, values, counts[0])) or columns
    found = [c for name, columns in tables.items() for c in channels_of(columns, joints, name)]
    if any(channel.kind in _SAYING for channel in found):
        return found, []
    return _side_by_side(path, tables, arm, hints)


def _side_by_side(
    path: Path, tables: dict[str, dict[str, FloatArray]], arm: LooseUrdf, hints: LogHints
) -> tuple[list[Channels], list[str]]:
    """Tables whose names say nothing, told apart as the columns of one file.

    Of inputs there may be one row less than of states: each stands for the step to the next state.
    """
    rows = max(len(values) for columns in tables.values() for values in columns.values())
    places = {
        f"{name}: {column}": (name, column)
        for name, columns in tables.items()
        for column, values in columns.items()
        if len(values) >= rows - 1
    }
    least = min(len(tables[name][column]) for name, column in places.values())
    columns = {key: tables[name][column][:least] for key, (name, column) in places.items()}
    found, words = told_apart(path, columns, arm, hints)
    channels = []
    for channel in found:
        files = [places[key][0] for key in channel.columns]
        if len(set(files)) > 1:
            raise CaptureError(f"{path}: {channel.label} stand in several files; write them into one")
        own = tuple(places[key][1] for key in channel.columns)
        channels.append(replace(channel, columns=own, file=files[0]))
    return channels, words


def _part(columns: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """The middle of a log of hours: enough to tell what is what."""
    rows = max((len(values) for values in columns.values()), default=0)
    if rows <= _MOST:
        return columns
    part = slice((rows - _MOST) // 2, (rows + _MOST) // 2)
    return {name: v[part].copy() if len(v) == rows else v for name, v in columns.items()}


def _tables(folder: Path) -> dict[str, dict[str, FloatArray]]:
    """The columns of the text tables in a folder, by the names of the files."""
    found = {}
    for file in sorted(folder.iterdir()):
        if file.suffix.lower() in TEXTS:
            try:
                found[file.name] = read_table(file).columns
            except CaptureError:
                if file.suffix.lower() == ".csv":
                    raise
    if not found:
        raise CaptureError(f"{folder}: a folder without tables ({', '.join(TEXTS)}) and no ROS 2 bag")
    return found
