"""A log and a URDF are enough: what the columns mean, guessed by name and size and proven on the data.

What comes out is a column map and a description, as a person would write them, and a sentence for each guess.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from daq.files.toml_text import toml_text
from daq.importing.channels import Channels, channels_of
from daq.importing.columns import read_table
from daq.importing.guess_frames import COUPLED, coupled_wrist, quarter_turns
from daq.importing.guess_torque import LogHints, given_factor, torque_table
from daq.importing.guess_which import Sampled, position_of, time_of, torque_of
from daq.importing.joint_states import is_bag_folder
from daq.importing.load import MAP_NAME, kept_rows
from daq.importing.log_arm import still_joints, write_description
from daq.importing.proof import TorqueProof
from daq.recording.capture import CaptureError
from ident.preparation.outliers import without_outliers
from robots import Robot
from robots.arrays import FloatArray
from robots.loose_urdf import LooseUrdf, read_loose_urdf

_LEAST = 50
"""Samples; shorter columns are constants."""
_FAR = 1.5
"""Times a joint's largest limit."""
_DEGREE = np.pi / 180
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
    channels = _channels(path, [joint.name for joint in arm.moving])
    series = [c for c in channels if len(c.values) >= _LEAST]
    position = position_of(path, series, len(arm.moving))
    same = [c for c in series if c is not position and len(c.values) == len(position.values)]
    stamps, time, said = time_of(path, same, len(position.values), hints.sample_rate)
    words = [*arm.words, said, f"position: {position.label}"]
    names = _joints_of(position, arm)
    values, table = _in_si(path, position, arm, names, hints, words)
    moving = [k for k in range(len(names)) if k not in still_joints(arm, names, values)]
    if not moving:
        raise CaptureError(f"{path}: no joint moves by {position.label}; allowed: a log of a moving arm")
    held = {joint.name: 0.0 for joint in arm.moving if joint.name not in names}
    held |= {names[k]: float(np.mean(values[:, k])) for k in range(len(names)) if k not in moving}
    if held:
        words.append(f"left out (at rest, or not in the log): {', '.join(held)}")
    kept, _ = kept_rows(path.name, stamps, values[:, moving])
    values, stamps = values[kept][:, moving], stamps[kept]
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
    torque = torque_of(path, [c for c in others if c is not reference])
    words += _named(velocity, others, torque, reference)
    usual = np.ptp(np.percentile(torque.values, (1, 99), axis=0), axis=0)
    torque = replace(torque, values=_mended(path, "control signal", stamps, torque.values, usual))
    chosen = tuple(names[k] for k in moving)
    robot = _description(folder, arm, chosen, held, log, torque, hints)
    coupled, log, offset, framed = _frames(robot, log, torque, table, hints)
    if coupled is not robot:
        robot = _description(folder, arm, chosen, held, log, torque, hints, coupled.transmission)
    words += framed
    means, more = torque_table(torque, log, robot, offset, _constants(channels, position, moving), hints, arm)
    columns: dict[str, Any] = {"format": 1, "time": time}
    columns["position"] = {
        **_taken(position, moving),
        **table,
        **({"offset": offset.tolist()} if offset.any() else {}),
    }
    if reference is not None:
        scaled = {**columns["position"], "unit": log.unit_of_reference(reference, table["unit"])}
        columns["reference"] = scaled | _taken(reference, moving)
    columns["torque"] = {**_taken(torque, moving), **means}
    (folder / MAP_NAME).write_text(toml_text(columns), encoding="utf-8")
    return GuessedLog(robot, columns, [*words, *more])


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


def _channels(path: Path, joints: Sequence[str]) -> list[Channels]:
    """All groups of columns of a file, or of the .csv files in a folder."""
    if not path.exists():
        raise CaptureError(f"{path}: no such file")
    if not path.is_dir() or is_bag_folder(path):
        return channels_of(read_table(path).columns, joints)
    files = sorted(file for file in path.iterdir() if file.suffix.lower() == ".csv")
    if not files:
        raise CaptureError(f"{path}: a folder without .csv files and no ROS 2 bag")
    return [c for file in files for c in channels_of(read_table(file).columns, joints, file.name)]


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


def _named(
    velocity: list[Channels], others: list[Channels], torque: Channels, reference: Channels | None
) -> list[str]:
    """A sentence for each channel, used or not."""
    words = [f"velocity, proven as the derivative of the position; not needed: {c.label}" for c in velocity]
    if reference is not None:
        words.append(f"reference, which the position follows: {reference.label}")
    for c in others:
        if c is torque or c is reference or c.kind in ("", "time"):
            continue
        second = c.kind == "position" and "second" in c.marks
        what = "second encoder" if second else " ".join([*sorted(c.marks & {"computed", "external"}), c.kind])
        words.append(f"{what}, read and not used: {c.label}")
    return words


def _joints_of(position: Channels, arm: LooseUrdf) -> tuple[str, ...]:
    """The joint of each column: by name, else in order; the first of the arm's where the log has fewer."""
    names = [joint.name for joint in arm.moving]
    said = [next((n for n in sorted(names, key=len, reverse=True) if n in c), "") for c in position.columns]
    if all(said) and len(set(said)) == len(said):
        return tuple(said)
    # An arm on a track is logged without it; a gripper behind an arm is not logged with it.
    count = len(position.columns)
    fits = [names[k : k + count] for k in range(len(names) - count + 1)]
    kinds = {joint.name: joint.kind for joint in arm.moving}
    return tuple(next((f for f in fits if all(kinds[n] == "revolute" for n in f)), fits[0]))


def _in_si(
    path: Path,
    position: Channels,
    arm: LooseUrdf,
    names: tuple[str, ...],
    hints: LogHints,
    words: list[str],
) -> tuple[FloatArray, dict[str, Any]]:
    """Joint positions in rad or m, and what the map says of their unit and side."""
    by_name = {joint.name: joint for joint in arm.moving}
    turning = np.array([by_name[name].kind == "revolute" for name in names])
    ends = [by_name[name].position or (-2 * np.pi, 2 * np.pi) for name in names]
    largest = np.array([max(abs(low), abs(high)) for low, high in ends])
    reach = np.abs(position.values).max(axis=0)
    small, large = ("rad", "deg") if turning.any() else ("m", "mm")
    factor = np.where(turning, _DEGREE if large == "deg" else 1.0, 1.0 if large == "deg" else 1e-3)
    marked = {"deg", "degree", "degrees", "grad", "mm"} & set(position.words)
    table: dict[str, Any] = {"unit": small}
    ratio = np.array(hints.ratio)
    if ratio.size not in (0, len(names)):
        raise CaptureError(
            f"--ratio has {ratio.size} numbers; allowed: {len(names)}, one per joint of {path}"
        )
    if (reach > _FAR * largest).any() and ratio.size and not marked:
        words.append("position: at the motors, by the limits of the URDF and the ratio")
        table, scale = {"unit": small, "side": "motor", "ratio": ratio.tolist()}, 1 / ratio
    elif marked or ((reach > _FAR * largest).any() and (reach * factor <= _FAR * largest).all()):
        words.append(
            f"unit of the position: {large}, by {'its name' if marked else 'the limits of the URDF'}"
        )
        table, scale = {"unit": large}, factor
    elif (reach > 2 * _FAR * largest).any():
        joint = int(np.argmax(reach / largest))
        raise CaptureError(
            f"{path}: {position.columns[joint]!r} reaches {reach[joint]:.4g}, in {small} or {large} beyond"
            f" joint {joint + 1}'s limit {largest[joint]:.3g}; at the motor? give --ratio"
        )
    else:
        scale = np.ones(len(names))
        words.append(f"unit of the position: {small}, within the limits of the URDF")
    return position.values * scale, table


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
    settings: dict[str, object] = {
        "cutoff_hz": log.cutoff,
        "decimation": decimation,
        "friction_width": log.friction_width,
    }
    if hints.sensor:
        settings["rotor_inertia"] = False
    position = log.position
    speed = np.abs(log.velocity).max(axis=0)
    force = np.abs(torque.values[:, log.moving]).max(axis=0)
    seen = (position.min(axis=0), position.max(axis=0), speed, force)
    return write_description(folder, arm, names, held, seen, settings, transmission)


def _frames(
    robot: Robot, log: Sampled, torque: Channels, table: dict[str, Any], hints: LogHints
) -> tuple[Robot, Sampled, FloatArray, list[str]]:
    """Zeros and coupling of the axes: the arm, its motion and offsets (n,) with them, and words."""
    given, _ = given_factor(hints, log)
    logged = log.even(torque.values[:, log.moving]) * given
    found, better = (robot, log), list[str]()
    proof = TorqueProof.of(robot, log.position, logged, log.period, log.cutoff)
    offset, words = quarter_turns(robot, proof)
    error = proof.error(offset)
    for transmission, position in coupled_wrist(robot, log.position) if "ratio" in table else []:
        rows = tuple(tuple(row) for row in transmission.tolist())
        tried = robot.model_copy(update={"transmission": rows})
        at_joints = np.asarray(logged @ transmission)
        other = TorqueProof.of(tried, position, at_joints, log.period, log.cutoff)
        turned, said = quarter_turns(tried, other)
        if other.error(turned) < COUPLED * error:
            found, error = (tried, replace(log, position=position)), other.error(turned)
            offset, words = turned, said
            better = [f"wrist: motor 6 turns with joints 5 and 6 ({transmission[5, 4]:+g}), by its torque"]
    if hints.offset:
        return *found, np.array(hints.offset)[log.moving], better
    return *found, offset, [*words, *better]


def _constants(channels: list[Channels], position: Channels, moving: Sequence[int]) -> dict[str, FloatArray]:
    """Vectors of the log with one number per joint: ratios and gains may be among them."""
    count = len(position.columns)
    return {
        c.label: c.values.ravel()[list(moving)]
        for c in channels
        if c.values.size == count and min(c.values.shape) == 1
    }
