"""A log and a URDF are enough: what the columns mean, guessed by name and size and proven on the data.

What comes out is a column map and a description, as a person would write them, and a sentence for each guess.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from daq.files.toml_text import toml_text
from daq.importing.channels import Channels
from daq.importing.guess_beside import beside_of, without_flagged, words_of_channels
from daq.importing.guess_cutoff import raised_cutoff
from daq.importing.guess_frames import axes_and_offsets
from daq.importing.guess_loop import loop_words
from daq.importing.guess_measured import measured_torque
from daq.importing.guess_position import in_si, joints_of
from daq.importing.guess_torque import LogHints, torque_table, with_sensors
from daq.importing.guess_which import Sampled, position_of, time_of, torques_of
from daq.importing.load import MAP_NAME, kept_rows
from daq.importing.log_arm import still_joints, write_description
from daq.importing.log_channels import channels_of_log
from daq.importing.log_quantities import POSITION_UNITS
from daq.recording.errors import CaptureError
from ident.decimation import decimation_reach
from ident.identification.excitation import one_way
from ident.listing import listed
from ident.preparation.outliers import without_outliers
from robots import Robot
from robots.arrays import FloatArray
from robots.loose_urdf import LooseUrdf, read_loose_urdf

_LEAST = 50
"""Samples; shorter columns are constants."""
_SETTLED, _TRIM, _SHORT = 1.2, 50, 30
"""Periods of the cut-off after which its filter has forgotten an end to a hundredth; the usual trim, samples,
and the share of a short log that at most is given up at either end.
"""
_FASTEST = 10.0
"""rad/s or m/s; of a joint whose limit the URDF does not give."""


@dataclass(frozen=True)
class GuessRequest:
    """What is to be guessed, and where the guesses are kept.

    Attributes:
        urdf: of the arm.
        hints: what the user says.
        save_map: the column map is written here; not where None.
        save_robot: folder that gets robot.toml, the URDF and the column map; not where None.
    """

    urdf: Path
    hints: LogHints = field(default_factory=LogHints)
    save_map: Path | None = None
    save_robot: Path | None = None


@dataclass
class GuessedLog:
    """What a log and a URDF are taken for.

    Attributes:
        robot: the arm, its files in the folder that was given.
        columns: the column map as plain tables; also ``import.toml`` in that folder.
        words: what was guessed, and by what it was proven, one short sentence each.
    """

    robot: Robot
    columns: dict[str, Any]
    words: list[str] = field(default_factory=list)


def guess_log(path: Path, urdf: Path, folder: Path, hints: LogHints) -> GuessedLog:
    """Guess what a log of an arm means.

    Args:
        path: a file of any kind that ``read_table`` reads, or a folder.
        urdf: of the arm.
        folder: exists; gets robot.toml, the URDF and import.toml.
        hints: what the user says.

    Raises:
        CaptureError: the log cannot be read, or no columns are what is needed; says what to give.
        RobotFileError: the URDF.
    """
    arm = read_loose_urdf(urdf)
    channels, told = channels_of_log(path, arm, hints)
    channels, hints = without_flagged(channels), with_sensors(channels, hints)
    series = [c for c in channels if len(c.values) >= _LEAST]
    position = position_of(path, series, len(arm.moving))
    same = [c for c in series if c is not position and len(c.values) == len(position.values)]
    stamps, time, said = time_of(path, same, len(position.values), hints.sample_rate)
    words = [*arm.words, *told, said, f"position: {position.label}"]
    names = joints_of(position, arm)
    values, table, scale = in_si(path, position, arm, names, hints, words)
    moving = [k for k in range(len(names)) if k not in still_joints(arm, names, values)]
    if not moving:
        raise CaptureError(f"{path}: no joint moves by {position.label}; allowed: a log of a moving arm")
    held = {joint.name: 0.0 for joint in arm.moving if joint.name not in names}
    held |= {names[k]: float(np.mean(values[:, k])) for k in range(len(names)) if k not in moving}
    if held:
        words.append(f"left out (at rest, or not in the log): {listed([*held])}")
    kept, _ = kept_rows(path.name, stamps, values[:, moving])
    values, stamps, scale = values[kept][:, moving], stamps[kept], scale[moving]
    same = [replace(c, values=c.values[kept]) for c in same]
    log = Sampled.of(
        path.name,
        stamps,
        _mended(path, "position", stamps, values, _steps(arm, names, stamps)[moving]),
        moving,
    )
    others = [c for c in same if len(c.columns) == len(position.columns)]
    velocity = [c for c in others if log.is_derivative(c)]
    others = [c for c in others if c not in velocity]
    reference = next((c for c in others if log.is_followed(c)), None)
    named = torques_of(path, [c for c in others if c is not reference])
    chosen = tuple(names[k] for k in moving)
    robot = _description(folder, arm, chosen, held, log, named[0], hints)
    torque, said_torque = measured_torque(named, log, robot)
    words += said_torque
    rest = [c for c in others if c is not torque]
    usual = np.ptp(np.percentile(torque.values, (1, 99), axis=0), axis=0)
    torque = replace(torque, values=_mended(path, "control signal", stamps, torque.values, usual))
    robot = _description(folder, arm, chosen, held, log, torque, hints)
    drives = log
    coupled, log, offset, framed = axes_and_offsets(robot, log, torque, table, hints)
    if coupled is not robot:
        robot = _description(folder, arm, chosen, held, log, torque, hints, coupled.transmission)
    words += [*framed, *_without_offset(robot)]
    tables, said_beside, used = beside_of([c for c in same if c is not position], log, robot, offset)
    words += [*said_beside, *words_of_channels(velocity, [c for c in rest if c not in used], reference)]
    means, more = torque_table(torque, log, robot, offset, _constants(channels, position, moving), hints, arm)
    times, tried = raised_cutoff(robot, log, torque, means, offset)
    if times > 1.0:
        log = replace(log, raised=times)
        robot = _description(folder, arm, chosen, held, log, torque, hints, robot.transmission)
    words += tried
    columns: dict[str, Any] = {"format": 1, "time": time}
    columns["position"] = {
        **_taken(position, moving),
        **table,
        **({"offset": offset.tolist()} if offset.any() else {}),
    }
    if reference is not None:
        turning = np.array([joint.kind == "revolute" for joint in robot.joint])
        unit = log.unit_of_reference(reference, table["unit"], scale, turning)
        scaled = {**columns["position"], "unit": unit}
        columns["reference"] = scaled | _taken(reference, moving)
        small = np.where(turning, *POSITION_UNITS[unit]) / np.where(turning, *POSITION_UNITS[table["unit"]])
        more += loop_words(drives, reference.values[:, moving] * scale * small, torque, rest)
    columns["torque"] = {**_taken(torque, moving), **means}
    columns |= tables
    (folder / MAP_NAME).write_text(toml_text(columns), encoding="utf-8")
    return GuessedLog(robot, columns, [*words, *more])


@contextmanager
def guessed_arm(path: Path, request: GuessRequest) -> Iterator[GuessedLog]:
    """The arm and the column map of a log, in a folder of its own as long as they are used; kept where asked.

    Raises:
        CaptureError, RobotFileError: as of :func:`guess_log` and :func:`save_guess`.
    """
    with TemporaryDirectory(prefix="armhil-") as folder:
        guessed = guess_log(path, request.urdf, Path(folder), request.hints)
        save_guess(Path(folder), request)
        yield guessed


def save_guess(folder: Path, request: GuessRequest) -> None:
    """Keep what was guessed where the user wants it; nothing is overwritten.

    Raises:
        CaptureError: a file is there already or cannot be written.
    """
    wanted = [(folder / MAP_NAME, request.save_map)] if request.save_map is not None else []
    if request.save_robot is not None:
        wanted += [(file, request.save_robot / file.name) for file in sorted(folder.iterdir())]
    for source, target in wanted:
        assert target is not None
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            with target.open("x", encoding="utf-8") as file:
                file.write(source.read_text(encoding="utf-8"))
        except FileExistsError:
            raise CaptureError(f"{target}: exists already; allowed: a new file") from None
        except OSError as error:
            raise CaptureError(f"{target}: cannot be written: {error.strerror}") from error


def _steps(arm: LooseUrdf, names: tuple[str, ...], stamps: FloatArray) -> FloatArray:
    """(n,) by how much a joint can be off its neighbours: what it moves in two periods at its speed limit."""
    speeds = {joint.name: joint.velocity or _FASTEST for joint in arm.moving}
    return 2.0 * np.array([speeds[name] for name in names]) * np.ptp(stamps) / (len(stamps) - 1)


def _mended(path: Path, what: str, stamps: FloatArray, values: FloatArray, far: FloatArray) -> FloatArray:
    """Without single wrong samples, which loading the log names: no guess is made of them."""
    return without_outliers(path.name, what, stamps, values, far)[0]


def _taken(channel: Channels, moving: Sequence[int]) -> dict[str, Any]:
    """Where a quantity of the map stands."""
    file = {} if channel.file is None else {"file": channel.file}
    return {"columns": [channel.columns[k] for k in moving], **file}


def _description(
    folder: Path,
    arm: LooseUrdf,
    names: tuple[str, ...],
    held: dict[str, float],
    log: Sampled,
    torque: Channels,
    hints: LogHints,
    transmission: tuple[tuple[float, ...], ...] = (),
) -> Robot:
    """Write the arm's files."""
    decimation = max(1, int(1 / (2 * log.cutoff * log.period)))
    unsettled = round(_SETTLED / (log.cutoff * log.period)) + decimation_reach(decimation, "fir")
    trim = max(_TRIM, min(unsettled, len(log.grid) // _SHORT))
    settings: dict[str, object] = {
        "cutoff_hz": log.cutoff,
        "decimation": decimation,
        "trim_samples": [trim, trim],
        "friction_width": log.friction_width,
    }
    if hints.sensor:
        settings["rotor_inertia"] = False
    if one_way(log.velocity).any():
        settings["offset"] = [not way for way in one_way(log.velocity).tolist()]
    position = log.position
    speed = np.abs(log.velocity).max(axis=0)
    force = np.abs(torque.values[:, log.moving]).max(axis=0)
    seen = (position.min(axis=0), position.max(axis=0), speed, force)
    return write_description(folder, arm, names, held, seen, settings, transmission)


def _without_offset(robot: Robot) -> list[str]:
    """A sentence where joints turn one way only."""
    offset = robot.identification.offset
    still = (
        []
        if isinstance(offset, bool)
        else [j.name for j, has in zip(robot.joint, offset, strict=True) if not has]
    )
    ways = "moves one way only: its" if len(still) == 1 else "move one way only: their"
    return [f"{listed(still)} {ways} dry friction holds what is constant of the torque"] if still else []


def _constants(channels: list[Channels], position: Channels, moving: Sequence[int]) -> dict[str, FloatArray]:
    """Vectors of the log with one number per joint: ratios and gains may be among them."""
    count = len(position.columns)
    return {
        c.label: c.values.ravel()[list(moving)]
        for c in channels
        if c.values.size == count and min(c.values.shape) == 1
    }
