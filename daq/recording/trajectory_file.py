"""Trajectory files: our own, exact (JSON), and plain samples for and from other programs (CSV).

docs/reference/trajectory-file.md documents both.
"""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from daq.recording.capture import CaptureError
from daq.recording.reader import read_capture
from daq.text.numbers import json_number
from robots import Robot
from robots.arrays import FloatArray
from robots.errors import UserError, shortened, shown
from trajectories import Motion, Repeat, Trajectory, TrajectoryError
from trajectories.motion_data import motion_data, motion_of
from trajectories.motions.sampled import SampledMotion, sampled_motion

FORMAT = 1
LEAST, LARGEST = 1e-6, 1e6
"""s, rad, m, rad/s …: no figure of a motion is larger."""
KIND = "armhil trajectory"
SUFFIX = ".trajectory.json"
MAX_BYTES = 256_000_000
_ROWS_AT_ONCE = 10_000

_TABLES = (".csv", ".tsv", ".txt")

_NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
_TIME_NAMES = ("time", "t", "time_s", "time [s]")


class TrajectoryFileError(UserError, ValueError):
    """A trajectory that cannot be read or written; the text is one line for the user."""


@dataclass(frozen=True)
class FoundMotion:
    """A motion from a file.

    Attributes:
        motion: as it is to be driven.
        cycle_time: s between its set-points.
        family: how it was made; ``imported`` where it is not ours.
        seed: that it was made from.
        score: of the objective it was planned with; NaN where it is not known.
        repeat: what of it is repeated.
        speed: < 1 for a slow run.
        robot_sha256: of the robot.toml that it was planned for; empty where it is not known.
    """

    motion: Motion
    cycle_time: float
    family: str = "imported"
    seed: int = 0
    score: float = float("nan")
    repeat: Repeat | None = None
    speed: float = 1.0
    robot_sha256: str = ""

    @property
    def is_exact(self) -> bool:
        """Whether it is known between samples too."""
        return not isinstance(self.motion, SampledMotion)


def description_sha256(robot: Robot) -> str:
    """Checksum of a robot.toml, by which a trajectory knows the arm it was planned for."""
    return sha256(robot.source_text.encode()).hexdigest()


def write_trajectory(path: Path, trajectory: Trajectory, robot: Robot) -> None:
    """Write the exact motion with how it was made. The same trajectory gives the same bytes.

    Raises:
        TrajectoryFileError: the file cannot be written.
    """
    _write(path, [trajectory_text(trajectory, robot)])


def trajectory_text(trajectory: Trajectory, robot: Robot) -> str:
    """What :func:`write_trajectory` writes."""
    content = {
        "kind": KIND,
        "format": FORMAT,
        "armhil": version("armhil"),
        "robot": {"name": robot.name, "sha256": description_sha256(robot)},
        "joints": [joint.name for joint in robot.joint],
        "cycle_time": trajectory.cycle_time,
        "duration": trajectory.duration,
        "family": trajectory.family,
        "seed": trajectory.seed,
        "score": json_number(trajectory.score),
        "speed": trajectory.speed,
        "repeat": None if trajectory.repeat is None else vars(trajectory.repeat),
        "motion": motion_data(trajectory.motion),
    }
    return json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def write_samples(path: Path, trajectory: Trajectory, robot: Robot) -> None:
    """Write the samples at the cycle: time, then position, velocity and acceleration of each joint.

    Raises:
        TrajectoryFileError: the file cannot be written.
    """
    names = [joint.name for joint in robot.joint]
    columns = [*names, *(f"{name}_velocity" for name in names), *(f"{name}_acceleration" for name in names)]
    _write(path, _lines(["time", *columns], trajectory))


def _lines(columns: list[str], trajectory: Trajectory) -> Iterator[str]:
    yield ",".join(columns) + "\n"
    for first in range(0, len(trajectory.time), _ROWS_AT_ONCE):
        part = slice(first, first + _ROWS_AT_ONCE)
        arrays = (trajectory.time, trajectory.position, trajectory.velocity, trajectory.acceleration)
        # The shortest text that reads back as the same number: rounding would look like jerk.
        for row in np.column_stack([array[part] for array in arrays]).tolist():
            yield ",".join(map(repr, row)) + "\n"


def read_motion(path: Path, robot: Robot) -> FoundMotion:
    """Read a motion from one of our files, a CSV file or a capture (its position reference).

    Raises:
        TrajectoryFileError: it cannot be read, or is no motion of this arm.
    """
    try:
        if path.suffix.lower() == ".mcap":
            capture = read_capture(path)
            _require_joints(path, capture.joints, robot)
            samples = capture.samples
            time = np.asarray(samples.cycle, dtype=np.float64) * capture.period
            return FoundMotion(sampled_motion(time - time[0], samples.reference), capture.period)
        if path.suffix.lower() not in (".json", *_TABLES):
            raise TrajectoryFileError(
                f"{path}: not a known kind of trajectory; allowed: {SUFFIX} (ours), "
                f"{', '.join(_TABLES)} (samples), .mcap (a capture)"
            )
        text = _text(path)
        if path.suffix.lower() == ".json":
            return _from_json(path, text, robot)
        return _from_csv(path, text, robot)
    except TrajectoryError as error:
        raise TrajectoryFileError(f"{path}: {shortened(error)}") from error
    except CaptureError as error:
        raise TrajectoryFileError(str(error)) from error


def _from_json(path: Path, text: str, robot: Robot) -> FoundMotion:
    allowed = f"a trajectory written by armhil ({SUFFIX}), a CSV file or a capture"
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise TrajectoryFileError(f"{path}: not JSON: {shortened(error)}; allowed: {allowed}") from None
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise TrajectoryFileError(f"{path}: has no kind {KIND!r}; allowed: {allowed}")
    if content.get("format") != FORMAT:
        raise TrajectoryFileError(f"{path}: format {shown(content.get('format'))}; allowed: {FORMAT}")
    try:
        _require_joints(path, content["joints"], robot)
        repeat, score = content["repeat"], content["score"]
        return FoundMotion(
            motion=motion_of(content["motion"], robot.n),
            cycle_time=_positive(path, "cycle_time", content["cycle_time"]),
            family=str(content["family"]),
            seed=int(content["seed"]),
            score=float("nan") if score is None else float(score),
            repeat=None if repeat is None else _repeat(repeat),
            speed=_positive(path, "speed", content["speed"]),
            robot_sha256=str(content["robot"]["sha256"]),
        )
    except KeyError as error:
        raise TrajectoryFileError(f"{path}: {error.args[0]}: missing") from None
    except (TypeError, ValueError, OverflowError, IndexError, RecursionError) as error:
        if isinstance(error, UserError):
            raise
        raise TrajectoryFileError(f"{path}: not a trajectory: {shortened(error)}") from None


def _repeat(values: dict[str, Any]) -> Repeat:
    return Repeat(float(values["start"]), float(values["period"]), int(values["count"]))


def _positive(path: Path, key: str, value: Any) -> float:
    if isinstance(value, int | float) and LEAST <= value <= LARGEST:
        return float(value)
    allowed = f"a number from {LEAST:g} to {LARGEST:g}"
    raise TrajectoryFileError(f"{path}: {key}: {shown(value)}; allowed: {allowed}")


def _from_csv(path: Path, text: str, robot: Robot) -> FoundMotion:
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise TrajectoryFileError(f"{path}: is empty; allowed: a column of times and one per joint")
    delimiter = next((mark for mark in (",", ";", "\t") if mark in lines[0]), ",")
    try:
        rows = list(csv.reader(lines, delimiter=delimiter))
    except csv.Error as error:
        raise TrajectoryFileError(f"{path}: not CSV: {error}; allowed: rows of numbers") from None
    header = None if _is_number(rows[0][0]) else [name.strip() for name in rows[0]]
    if header is not None and (twice := sorted({name for name in header if header.count(name) > 1})):
        raise TrajectoryFileError(f"{path}: more than one column {shown(twice[0])}; allowed: one of a name")
    values = _numbers(path, rows if header is None else rows[1:], len(rows[0]))
    names = [joint.name for joint in robot.joint]
    if header is None:
        if values.shape[1] != robot.n + 1:
            raise TrajectoryFileError(
                f"{path}: {values.shape[1]} columns without names; allowed: {robot.n + 1}, time and joints"
            )
        return _of_samples(values[:, 0], values[:, 1:], None)
    time = next((k for k, name in enumerate(header) if name.lower() in _TIME_NAMES), None)
    missing = [name for name in names if name not in header] + ([] if time is not None else ["time"])
    if missing or time is None:
        raise TrajectoryFileError(f"{path}: no column {', '.join(missing)}; present: {', '.join(header)}")
    position = values[:, [header.index(name) for name in names]]
    speeds = [f"{name}_velocity" for name in names]
    velocity = values[:, [header.index(name) for name in speeds]] if set(speeds) <= set(header) else None
    return _of_samples(values[:, time], position, velocity)


def _of_samples(time: FloatArray, position: FloatArray, velocity: FloatArray | None) -> FoundMotion:
    motion = sampled_motion(time, position, velocity)
    return FoundMotion(motion, motion.step)


def _numbers(path: Path, rows: Sequence[Sequence[str]], width: int) -> FloatArray:
    for number, row in enumerate(rows, start=1):
        if len(row) != width:
            raise TrajectoryFileError(f"{path}: row {number} has {len(row)} values; allowed: {width}")
        for value in row:
            if not _is_number(value):
                raise TrajectoryFileError(f"{path}: row {number}: {value[:40]!r} is not a number")
            if abs(float(value)) > LARGEST:
                raise TrajectoryFileError(
                    f"{path}: row {number}: {value[:40]} is beyond any motion; allowed: up to {LARGEST:g}"
                )
    return np.array(rows, dtype=np.float64).reshape(len(rows), width)


def _is_number(text: str) -> bool:
    """Whether it is a decimal number as every program writes one: no 1_000, no nan, no other digits."""
    return _NUMBER.fullmatch(text.strip(" ")) is not None


def _require_joints(path: Path, found: Sequence[str], robot: Robot) -> None:
    names = [joint.name for joint in robot.joint]
    if list(found) != names:
        given = ", ".join(map(str, found))
        raise TrajectoryFileError(f"{path}: is for the joints {given}; allowed: {', '.join(names)}")


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise TrajectoryFileError(f"{path}: larger than {MAX_BYTES} bytes; allowed: a trajectory")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise TrajectoryFileError(f"{path}: no such file; allowed: a trajectory") from None
    except OSError as error:
        raise TrajectoryFileError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise TrajectoryFileError(f"{path}: not UTF-8 text; allowed: a trajectory") from None


def _write(path: Path, texts: Iterable[str]) -> None:
    try:
        with path.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(texts)
    except OSError as error:
        raise TrajectoryFileError(f"{path}: cannot be written: {error.strerror}") from error
