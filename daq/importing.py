"""Recordings as ident reads them, from our own captures and from what others recorded."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.capture import Capture, CaptureError
from daq.columns import Table, read_table
from daq.import_map import ImportMap, Position, Torque
from ident import Recording
from robots import Robot
from robots.arrays import FloatArray

POSITION_UNITS = {"rad": 1.0, "deg": np.pi / 180, "m": 1.0, "mm": 1e-3}
TORQUE_UNITS = {"N*m": 1.0, "mN*m": 1e-3, "N": 1.0}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def load_recording(path: Path, robot: Robot, columns: ImportMap) -> Recording:
    """Read a recording that armhil did not make.

    Args:
        path: a .mat file, a .csv file, or a folder with one .csv file per quantity.
        robot: the arm; its transmission, gains and joint kinds complete the conversion.
        columns: what the columns mean.

    Raises:
        CaptureError: one line: a missing file or variable, values that are not numbers, wrong lengths.
        ident.IdentificationError: the time is not uniform.
    """
    source = _Source(path)
    position = _position(source, columns.position, robot)
    reference = None if columns.reference is None else _position(source, columns.reference, robot)
    control_signal = _control_signal(source, columns, robot)
    time = _time(source, columns, len(position))
    lengths = {"time": len(time), "position": len(position), "control signal": len(control_signal)}
    if reference is not None:
        lengths["reference"] = len(reference)
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise CaptureError(f"{path}: quantities differ in length: {listed} samples")
    return Recording(
        name=path.name, time=time, reference=reference, position=position, control_signal=control_signal
    )


def capture_recordings(capture: Capture) -> list[Recording]:
    """The uninterrupted pieces of a capture. Gaps are not filled: each piece is a recording of its own."""
    segments = capture.segments()
    if not segments:
        raise CaptureError(f"{capture.path}: there is no cycle in which every drive answered")
    return [
        Recording(
            name=capture.path.name if len(segments) == 1 else f"{capture.path.name}, piece {number}",
            time=segment.time,
            reference=segment.reference,
            position=segment.position,
            control_signal=segment.control_signal,
        )
        for number, segment in enumerate(segments, start=1)
    ]


class _Source:
    """A file, or a folder of files, read once each."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._tables: dict[Path, Table] = {}

    def pick(self, file: str | None, names: tuple[str, ...]) -> FloatArray:
        path = self.path
        if path.is_dir():
            if file is None:
                raise CaptureError(f"{path}: is a folder, but the column map names no file in it")
            path = path / file
        if path not in self._tables:
            self._tables[path] = read_table(path)
        values = self._tables[path].pick(names)
        bad = np.argwhere(~np.isfinite(values))
        if bad.size:
            row, column = bad[0]
            raise CaptureError(
                f"{path}: {names[column]!r} is not a number at sample {row} ({len(bad)} in all)"
            )
        return values


def _check_count(what: str, count: int, robot: Robot, path: Path) -> None:
    if count != robot.n:
        raise CaptureError(f"{path}: the column map gives {count} {what}; {robot.name} has {robot.n} joints")


def _position(source: _Source, columns: Position, robot: Robot) -> FloatArray:
    """Joint positions in rad or m: unit, then motor → drive output, then drive output → joint."""
    _check_count("position columns", len(columns.columns), robot, source.path)
    values: FloatArray = source.pick(columns.file, columns.columns) * POSITION_UNITS[columns.unit]
    if columns.side == "motor":
        values = np.asarray(values / _ratio(columns.ratio, robot, source.path))
    if columns.side != "joint":
        values = np.asarray(np.linalg.solve(robot.transmission_matrix, values.T).T, dtype=np.float64)
    if columns.offset is not None:
        _check_count("offsets", len(columns.offset), robot, source.path)
        values = values + np.array(columns.offset)
    return values


def _ratio(ratio: tuple[float, ...] | None, robot: Robot, path: Path) -> FloatArray:
    values = np.array(ratio or (), dtype=np.float64)
    _check_count("ratios", len(values), robot, path)
    return values


def _control_signal(source: _Source, columns: ImportMap, robot: Robot) -> FloatArray:
    if columns.control_signal is not None:
        signal = columns.control_signal
        _check_count("control-signal columns", len(signal.columns), robot, source.path)
        return source.pick(signal.file, signal.columns) * signal.scale
    assert columns.torque is not None  # the map has one of both
    return _signal_of_torque(source, columns.torque, robot)


def _signal_of_torque(source: _Source, columns: Torque, robot: Robot) -> FloatArray:
    """v_τ = drive torque / g_τ (eq. 5), with the torque taken to the drive output first."""
    _check_count("torque columns", len(columns.columns), robot, source.path)
    torque = source.pick(columns.file, columns.columns) * TORQUE_UNITS[columns.unit]
    if columns.side == "joint":
        return robot.control_signal(torque)
    if columns.side == "motor":
        torque = torque * _ratio(columns.ratio, robot, source.path)
    return np.asarray(torque / robot.gains)


def _time(source: _Source, columns: ImportMap, samples: int) -> FloatArray:
    time = columns.time
    if time.column is None:
        assert time.sample_rate_hz is not None  # the map has one of both
        return np.arange(samples) / time.sample_rate_hz
    return source.pick(time.file, (time.column,))[:, 0] * TIME_UNITS[time.unit]
