"""The quantities of a log as its column map names them: time, positions and control signals in SI units."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from daq.importing.bags import is_bag_folder
from daq.importing.columns import Table, read_table
from daq.importing.import_map import (
    ImportMap,
    Position,
    Torque,
)
from daq.importing.pieces import bridged
from daq.recording.errors import CaptureError
from ident.listing import short
from robots import Robot
from robots.arrays import BoolArray, FloatArray

DEGREE = np.pi / 180
POSITION_UNITS = {
    "rad": (1.0, 1.0),
    "m": (1.0, 1.0),
    "deg": (DEGREE, 1.0),
    "mm": (1.0, 1e-3),
    "deg, mm": (DEGREE, 1e-3),
}
"""rad per unit of a joint that turns, m per unit of one that slides."""
TORQUE_UNITS = {"N*m": (1.0, 1.0), "mN*m": (1e-3, 1.0), "N": (1.0, 1.0)}
"""N·m per unit of a joint that turns, N per unit of one that slides."""
_ROWS = 100_000
"""Rows that are converted together."""
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def unit_of(turning: BoolArray, degrees: bool, millimetres: bool) -> str:
    """Of an arm's positions, as a column map says it.

    Args:
        turning: (n,) which joints turn; the others slide.
        degrees, millimetres: whether those that turn, those that slide are in them.
    """
    parts = ["deg"] * (degrees and bool(turning.any())) + ["mm"] * (millimetres and not turning.all())
    return ", ".join(parts) or ("rad" if turning.any() else "m")


def answered(source: LogFiles, columns: ImportMap, robot: Robot) -> BoolArray | None:
    """Samples × joints: whether each drive answered; None where the map says nothing of it.

    From then on the source does not mind what is not a number in rows in which one did not.
    """
    if columns.complete is None:
        return None
    if len(columns.complete.columns) != 1:
        _check_count("columns of complete", len(columns.complete.columns), robot, source.path)
    flags = source.pick(columns.complete.file, columns.complete.columns) != 0
    source.flagged = ~flags.all(axis=1)
    return np.broadcast_to(flags, (len(flags), robot.n)).copy()


class LogFiles:
    """A file, or a folder of files, read once each."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.flagged: BoolArray | None = None
        """(N,) rows in which some drive did not answer: what stands there counts for nothing."""
        self._tables: dict[Path, Table] = {}

    @property
    def words(self) -> tuple[str, ...]:
        """What is missing in the files that were read, one sentence each."""
        return tuple(words for table in self._tables.values() for words in table.words)

    def give_up(self) -> None:
        """Forget what was read: long logs fill the memory."""
        self._tables.clear()

    def pick(self, file: str | None, names: tuple[str, ...]) -> FloatArray:
        path = self.path
        if path.is_dir() and not is_bag_folder(path):
            if file is None:
                raise CaptureError(f"{path}: is a folder, but the column map names no file in it")
            path = path / file
        if path not in self._tables:
            self._tables[path] = read_table(path)
        values = self._tables[path].pick(names)
        if self.flagged is not None and len(self.flagged) == len(values):
            for column in values.T:
                bridged(column[:, np.newaxis], self.flagged & ~np.isfinite(column))
        bad = np.argwhere(~np.isfinite(values))
        if bad.size:
            row, column = bad[0]
            raise CaptureError(
                f"{path}: {short(names[column])!r} is not a number at sample {row} ({len(bad)} in all)"
            )
        return values


def by_rows(values: FloatArray, convert: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Rows changed where they stand, block by block: a log of hours does not fit into the memory many times.

    Args:
        values: samples × n, changed.
        convert: what becomes of some rows.
    """
    for start in range(0, len(values), _ROWS):
        values[start : start + _ROWS] = convert(values[start : start + _ROWS])
    return values


def _check_count(what: str, count: int, robot: Robot, path: Path) -> None:
    if count != robot.n:
        raise CaptureError(f"{path}: the column map gives {count} {what}; {robot.name} has {robot.n} joints")


def position_of_joints(source: LogFiles, columns: Position, robot: Robot) -> FloatArray:
    """Joint positions in rad or m: unit, then motor → drive output, then drive output → joint."""
    _check_count("position columns", len(columns.columns), robot, source.path)
    values = source.pick(columns.file, columns.columns)
    scales = _scales(POSITION_UNITS[columns.unit], robot)
    if columns.side == "motor":
        scales = scales / _factors("ratios", columns.ratio, robot, source.path)
    inverse = np.eye(robot.n) if columns.side == "joint" else np.linalg.inv(robot.transmission_matrix)
    offset = np.zeros(robot.n)
    if columns.offset is not None:
        _check_count("offsets", len(columns.offset), robot, source.path)
        offset = np.array(columns.offset)
    return by_rows(values, lambda rows: (rows * scales) @ inverse.T + offset)


def _scales(unit: tuple[float, float], robot: Robot) -> FloatArray:
    """(n,) SI per unit, by how each joint moves."""
    return np.array([unit[joint.kind == "prismatic"] for joint in robot.joint])


def _factors(what: str, given: tuple[float, ...] | None, robot: Robot, path: Path) -> FloatArray:
    values = np.array(given or (), dtype=np.float64)
    _check_count(what, len(values), robot, path)
    return values


def control_signal_of_drives(source: LogFiles, columns: ImportMap, robot: Robot) -> FloatArray:
    if columns.control_signal is not None:
        signal = columns.control_signal
        _check_count("control-signal columns", len(signal.columns), robot, source.path)
        return by_rows(source.pick(signal.file, signal.columns), lambda rows: rows * signal.scale)
    assert columns.torque is not None  # the map has one of both
    return _signal_of_torque(source, columns.torque, robot)


def _signal_of_torque(source: LogFiles, columns: Torque, robot: Robot) -> FloatArray:
    """v_τ = drive torque / g_τ (eq. 5), with the torque taken to the drive output first."""
    _check_count("torque columns", len(columns.columns), robot, source.path)
    torque = source.pick(columns.file, columns.columns)
    scales = np.ones(robot.n) if columns.unit is None else _scales(TORQUE_UNITS[columns.unit], robot)
    if columns.side in ("joint", "sensor"):
        return by_rows(torque, lambda rows: robot.control_signal(rows * scales))
    if columns.side == "motor":
        scales = scales * _factors("ratios", columns.ratio, robot, source.path)
    if columns.side == "current":
        scales = scales * _factors("gains", columns.gain, robot, source.path)
    return by_rows(torque, lambda rows: rows * scales / robot.gains)


def time_of_samples(source: LogFiles, columns: ImportMap, samples: int) -> FloatArray:
    time = columns.time
    if time.column is None:
        assert time.sample_rate_hz is not None  # the map has one of both
        return np.arange(samples) / time.sample_rate_hz
    return source.pick(time.file, (time.column,))[:, 0] * TIME_UNITS[time.unit]
