"""Guess from names and sizes what the columns of a log mean, as a column map for a person to look over."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from daq.files.toml_text import toml_text
from daq.importing.columns import Table, read_table
from daq.recording.capture import CaptureError
from robots import Robot

_TIME_NAMES = ("t", "time", "stamp", "timestamp", "sec", "seconds", "zeit")
_REFERENCE = r"(?:ref|reference|cmd|command|commanded|des|desired|target|set|setpoint|soll|r|d)"
_POSITION = r"(?:q|qm|qj|pos|position|positions|theta|angle|joint|joint_?pos(?:ition)?|act|actual|ist)"
# What the name of a column is once its number or joint is taken off; the first that fits counts.
_KINDS = (
    ("reference", re.compile(rf"{_POSITION}_?{_REFERENCE}|{_REFERENCE}_?{_POSITION}")),
    ("position", re.compile(rf"(?:{_POSITION}_?)+(?:m|mes|meas|measured)?")),
    (
        "torque",
        re.compile(r"(?:joint_?)?(?:tau|torque|torques|trq|effort|efforts|moment)(?:_?(?:m|mes|meas))?"),
    ),
    (
        "control_signal",
        re.compile(r"(?:v|vir|u|control_?signal|current|cur|i|iq|volt|voltage|command_?signal)"),
    ),
)
_NUMBER = re.compile(r"^(.*?)[ _:.\[(]*(\d+)[\])]?$")
_DEGREES = 2 * np.pi * 1.5
"""Above it, angles are hardly radians."""


def guess_map(source: Path, robot: Robot) -> dict[str, Any]:
    """A column map as plain tables.

    Args:
        source: a file with named columns, or a folder with a ROS 2 bag.
        robot: the arm; columns are looked for by its joints' names and their number.

    Raises:
        CaptureError: the file cannot be read, or nothing in it looks like positions and torques.
    """
    table = read_table(source)
    groups = _groups(table, robot)
    found: dict[str, Any] = {"format": 1, "time": _time(table, groups.get("position", ()))}
    for kind in ("position", "reference"):
        if kind in groups:
            found[kind] = {"columns": list(groups[kind]), "unit": _position_unit(table, groups[kind], robot)}
    for kind, keys in (("control_signal", {}), ("torque", {"unit": "N*m"})):
        if kind in groups and "torque" not in found and "control_signal" not in found:
            found[kind] = {"columns": list(groups[kind]), **keys}
    missing = [name for name in ("position",) if name not in found]
    missing += [] if "torque" in found or "control_signal" in found else ["torque or control signal"]
    if missing:
        present = ", ".join(sorted(table.columns)) or "none"
        raise CaptureError(
            f"{source}: no {robot.n} columns look like {' and '.join(missing)}; write a column map by hand;"
            f" present: {present}"
        )
    return found


def _groups(table: Table, robot: Robot) -> dict[str, tuple[str, ...]]:
    """Columns by kind, in the order of the joints, where there is one for each."""
    stems: dict[str, dict[str, str]] = {}
    for column in table.columns:
        if (found := _stem_and_joint(column, robot)) is not None:
            stems.setdefault(found[0], {})[found[1]] = column
    joints = [joint.name for joint in robot.joint]
    groups: dict[str, tuple[str, ...]] = {}
    for kind, pattern in _KINDS:
        for stem, columns in stems.items():
            taken = columns.get(joints[0]) in {c for group in groups.values() for c in group}
            if (
                kind not in groups
                and not taken
                and pattern.fullmatch(_last_word(stem))
                and set(columns) == set(joints)
            ):
                groups[kind] = tuple(columns[joint] for joint in joints)
    return groups


def _last_word(stem: str) -> str:
    """The field of a JointState, where the name is a topic's; else the name."""
    return stem.strip("/").rpartition("/")[2].lower()


def _stem_and_joint(column: str, robot: Robot) -> tuple[str, str] | None:
    """What a column's name begins with, and the joint it ends with, by name or by number from 1 (or 0)."""
    for joint in sorted((joint.name for joint in robot.joint), key=len, reverse=True):
        if column.endswith(joint) and (stem := column[: -len(joint)].rstrip(" /_.:")):
            return stem, joint
    if (numbered := _NUMBER.match(column)) and 1 <= int(numbered[2]) <= robot.n:
        return numbered[1].rstrip(" _:.[("), robot.joint[int(numbered[2]) - 1].name
    return (column, robot.joint[0].name) if robot.n == 1 else None


def _time(table: Table, positions: Sequence[str]) -> dict[str, Any]:
    topic = positions[0].rsplit("/", 2)[0] if positions and "/" in positions[0] else ""
    wanted = [f"{topic}/stamp"] if topic else []
    wanted += [name for name in table.columns if _last_word(name).split("[")[0].strip(" _s") in _TIME_NAMES]
    wanted += [name for name in table.columns if _last_word(name) in _TIME_NAMES]
    for name in wanted:
        if name in table.columns and _increases(table.columns[name]):
            return {"column": name, "unit": _time_unit(table.columns[name])}
    raise CaptureError(
        f"{table.path}: no column looks like time; write a column map by hand, with sample_rate_hz where"
        f" there is none; present: {', '.join(sorted(table.columns))}"
    )


def _increases(values: np.ndarray[Any, np.dtype[np.float64]]) -> bool:
    return len(values) > 2 and bool((np.diff(values) > 0).all())


def _time_unit(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    """The unit in which the sampling period lies between 0.05 ms and 0.1 s."""
    step = float(np.median(np.diff(values)))
    scales = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    return next((unit for unit, scale in scales.items() if 5e-5 <= step * scale <= 0.1), "s")


def _position_unit(table: Table, columns: Sequence[str], robot: Robot) -> str:
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
