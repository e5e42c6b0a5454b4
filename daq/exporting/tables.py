"""The samples of a capture as a table: CSV, Parquet, MATLAB; and the column map that reads it back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from daq.recording.capture import Capture, CaptureError
from robots import Robot
from robots.extras import install_command

Values = NDArray[Any]

# Quantity → what its columns are called.
_NAMES = {
    "reference": "q_ref",
    "position": "q",
    "velocity": "qd",
    "control_signal": "v",
    "torque": "tau",
    "following_error": "e",
    "statusword": "statusword",
    "complete": "complete",
}
_LONGEST_MATLAB_NAME = 31


def quantities(capture: Capture, robot: Robot) -> dict[str, Values]:
    """What is exported: N × n by name of the columns, and ``t`` and ``cycle``, (N,).

    Args:
        capture: with its samples.
        robot: of its description; the gains give the torques.
    """
    samples = capture.samples
    found: dict[str, Values] = {"t": samples.time, "cycle": samples.cycle}
    if capture.has_reference:
        found[_NAMES["reference"]] = samples.reference
    found[_NAMES["position"]] = samples.position
    if np.isfinite(samples.velocity).any():
        found[_NAMES["velocity"]] = samples.velocity
    found[_NAMES["control_signal"]] = samples.control_signal
    found[_NAMES["torque"]] = robot.joint_torque(samples.control_signal)
    if capture.has_reference:
        found[_NAMES["following_error"]] = samples.reference - samples.position
    found[_NAMES["statusword"]] = samples.statusword
    found[_NAMES["complete"]] = samples.complete.astype(np.uint8)
    return found


def import_map(capture: Capture, robot: Robot, name: Callable[[str, int], str]) -> dict[str, Any]:
    """The column map with which ``armhil import`` reads the table back.

    Args:
        capture: what was exported.
        robot: of its description.
        name: of a quantity's column for a joint (from 0).
    """

    def columns(quantity: str) -> list[str]:
        return [name(_NAMES[quantity], axis) for axis in range(len(capture.joints))]

    # An arm with joints of both kinds has rad and m beside each other; neither is converted.
    unit = "m" if all(joint.kind == "prismatic" for joint in robot.joint) else "rad"
    found: dict[str, Any] = {
        "format": 1,
        "time": {"column": "t"},
        "position": {"columns": columns("position"), "unit": unit},
        "control_signal": {"columns": columns("control_signal")},
        "complete": {"columns": columns("complete")},
    }
    if capture.has_reference:
        found["reference"] = {"columns": columns("reference"), "unit": unit}
    return found


def flat_name(joints: Sequence[str]) -> Callable[[str, int], str]:
    """Names of the columns of CSV and Parquet: quantity and joint."""
    return lambda quantity, axis: f"{quantity}_{joints[axis]}"


def matlab_name(joints: Sequence[str]) -> Callable[[str, int], str]:
    """As the import names the columns of a matrix; a single joint is a vector."""
    if len(joints) == 1:
        return lambda quantity, _: quantity
    return lambda quantity, axis: f"{quantity}:{axis + 1}"


def write_csv(file: BinaryIO, table: dict[str, Values], joints: Sequence[str]) -> None:
    """One header line, commas, and every digit of each number."""
    columns = _flat(table, joints)
    file.write((",".join(_quoted(name) for name in columns) + "\r\n").encode())
    texts = [_texts(values) for values in columns.values()]
    file.writelines((",".join(row) + "\r\n").encode() for row in zip(*texts, strict=True))


def _quoted(name: str) -> str:
    plain = not any(mark in name for mark in ',"\r\n')
    return name if plain else '"' + name.replace('"', '""') + '"'


def _texts(values: Values) -> list[str]:
    return [repr(value) for value in values.tolist()]


def write_parquet(path: Path, file: BinaryIO, table: dict[str, Values], joints: Sequence[str]) -> None:
    """Columns as in CSV, each in its own type.

    Raises:
        CaptureError: pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        command = install_command("parquet")
        raise CaptureError(f"{path}: Parquet needs pyarrow; install it with: {command}") from None
    columns = _flat(table, joints)
    parquet.write_table(pa.table({name: np.ascontiguousarray(v) for name, v in columns.items()}), file)


def write_mat(path: Path, table: dict[str, Values]) -> None:
    """A MATLAB file of version 5: a matrix per quantity, one column per joint."""
    from scipy.io import savemat

    assert all(len(name) <= _LONGEST_MATLAB_NAME for name in table)
    savemat(path, table, appendmat=False, do_compression=True, oned_as="column")


def _flat(table: dict[str, Values], joints: Sequence[str]) -> dict[str, Values]:
    name = flat_name(joints)
    columns: dict[str, Values] = {}
    for quantity, values in table.items():
        if values.ndim == 1:
            columns[quantity] = values
        else:
            columns |= {name(quantity, axis): values[:, axis] for axis in range(len(joints))}
    return columns
