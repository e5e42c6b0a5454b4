"""Recordings as ident reads them, from what others recorded; our own captures are in ``captures``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from daq.importing.beside import channels_beside, with_beside
from daq.importing.columns import ALLOWED
from daq.importing.import_map import ImportMap, load_import_map, settings_of
from daq.importing.loaded import LoadedRecordings
from daq.importing.log_quantities import (
    LogFiles,
    answered,
    control_signal_of_drives,
    position_of_joints,
    time_of_samples,
)
from daq.importing.pieces import answered_pieces, complete_at, in_parts, put_back, set_aside
from daq.importing.rounding import rounded
from daq.recording.errors import CAPTURE_SUFFIX, CaptureError
from ident import Recording
from ident.identification.second_encoder import words_of_second
from ident.listing import listed, seconds
from ident.ordered import median
from ident.preparation.held import clipped, not_held, repeated
from ident.preparation.outliers import without_outliers
from ident.preparation.resampling import uniform_recording
from robots import Robot
from robots.arrays import BoolArray, FloatArray

MAP_NAME = "import.toml"
_UNFLAGGED = "; rows that are taken out of the log, in place of a flag, are filled as missing samples are"


def _nobody(share: float) -> None:
    """Nobody watches."""


def load_recording(
    path: Path, robot: Robot, columns: Path | None = None, done: Callable[[float], None] = _nobody
) -> LoadedRecordings:
    """Read a capture, or a log that a column map describes.

    Args:
        path: a capture (.mcap), a .mat file, a .csv file, or a folder with .csv files.
        robot: the arm.
        columns: the column map of a log; ``import.toml`` beside the robot's description where None.
        done: called with the share of a log that is read and looked over.

    Raises:
        CaptureError: one line: a missing file or variable, values that are not numbers, wrong lengths.
        ident.IdentificationError: time goes back, or there are too few samples.
    """
    if path.suffix.lower() == CAPTURE_SUFFIX:
        from daq.importing.captures import load_capture  # captures need the drivers; logs do not

        return load_capture(path, robot)
    return load_log(path, robot, columns, done)


def load_log(
    path: Path, robot: Robot, columns: Path | None = None, done: Callable[[float], None] = _nobody
) -> LoadedRecordings:
    """Read a recording that armhil did not make.

    Args:
        path: a file of one of the kinds that ``read_table`` reads, a folder with one .csv file per quantity,
            or a folder with a ROS 2 bag.
        robot: the arm; its transmission, gains and joint kinds complete the conversion.
        columns: the column map; ``import.toml`` beside the robot's description where None.
        done: called with the share that is read and looked over.

    Raises:
        CaptureError: one line: a missing file or variable, values that are not numbers, wrong lengths.
        ident.IdentificationError: time goes back, or there are too few samples.
    """
    if not path.exists():
        raise CaptureError(f"{path}: no such file; allowed: a capture (.mcap), {ALLOWED}")
    map_path = columns if columns is not None else robot.folder / MAP_NAME
    meaning = load_import_map(map_path)
    settings = settings_of(meaning, robot, map_path)
    recording, complete, warnings = log_recording(path, robot, meaning, settings.cutoff_hz, done)
    remedy = "" if meaning.complete is None else _UNFLAGGED
    recordings, dropped = answered_pieces(path, recording, complete, remedy)
    recordings = tuple(part for recording in recordings for part in in_parts(recording, settings))
    return LoadedRecordings(path, recordings, settings, None, (*warnings, *filter(None, [dropped])))


def log_recording(
    path: Path,
    robot: Robot,
    columns: ImportMap,
    cutoff_hz: float,
    done: Callable[[float], None] = _nobody,
) -> tuple[Recording, BoolArray, tuple[str, ...]]:
    """What a column map makes of a log; for the errors see :func:`load_log`.

    Args:
        path: the log.
        robot: the arm.
        columns: the column map.
        cutoff_hz: of the positions' low-pass, by which gaps are judged.
        done: called with the share that is read and looked over.

    Returns:
        The recording of N samples, N × n whether each drive answered, and sentences of warning.
    """
    source = LogFiles(path)
    complete = answered(source, columns, robot)
    written = columns.position
    held = rounded(path.name, written.columns, source.pick(written.file, written.columns))
    position = position_of_joints(source, columns.position, robot)
    reference = None if columns.reference is None else position_of_joints(source, columns.reference, robot)
    control_signal = control_signal_of_drives(source, columns, robot)
    time = time_of_samples(source, columns, len(position))
    lengths = {"time": len(time), "position": len(position), "control signal": len(control_signal)}
    if reference is not None:
        lengths["reference"] = len(reference)
    beside = channels_beside(source, columns, robot, position)
    if complete is not None:
        lengths["complete"] = len(complete)
    lengths |= {name.replace("_", " "): len(values) for name, values in beside.items()}
    rows = min(lengths.values())
    short = [name for name, length in lengths.items() if length == rows]
    if max(lengths.values()) > rows + 1:
        other = [f"{name} {length}" for name, length in lengths.items() if length != len(position)]
        lengths_said = f"position {len(position)}, {listed(other)} samples"
        raise CaptureError(f"{path}: quantities differ in length: {lengths_said}")
    read = source.words
    if len(short) < len(lengths):  # inputs stand for the steps between states, of which there is one more
        read += (f"{path.name}: {listed(short)}: one row less than the rest, whose last one is left out",)
        time, position, control_signal = time[:rows], position[:rows], control_signal[:rows]
        reference = None if reference is None else reference[:rows]
        complete = None if complete is None else complete[:rows]
        beside = {channel: values[:rows] for channel, values in beside.items()}
    source.give_up()
    done(0.25)
    written_there: dict[str, FloatArray] = {}
    if complete is None:
        kept, stuck = kept_rows(path.name, time, position, control_signal)
        if not kept.all():
            time, position, control_signal = time[kept], position[kept], control_signal[kept]
            reference = None if reference is None else reference[kept]
            beside = {channel: values[kept] for channel, values in beside.items()}
    else:  # what no drive answered is known, and often held
        stuck = _said_of_flags(path.name, time, complete)
        channels = {"position": position, "control_signal": control_signal, "reference": reference, **beside}
        written_there = set_aside({k: v for k, v in channels.items() if v is not None}, complete)
    held = (*stuck, *held)
    done(0.6)
    held += clipped(path.name, "control signal", control_signal)
    done(0.8)
    # A joint cannot be farther from its neighbours than it moves in two periods at its speed limit.
    step = 2.0 * robot.velocity_limits * median(np.diff(time)) if len(time) > 1 else np.zeros(robot.n)
    position, wrong = without_outliers(path.name, "position", time, position, step)
    limit = np.abs(robot.control_signal(robot.torque_limits[np.newaxis]))[0]
    control_signal, odd = without_outliers(path.name, "control signal", time, control_signal, limit)
    done(0.95)
    even = uniform_recording(path.name, time, reference, position, control_signal, cutoff_hz, beside)
    recording, said = with_beside(even, cutoff_hz)
    there = np.repeat(even.there[:, np.newaxis], robot.n, axis=1)
    if complete is not None:
        there &= complete_at(even.recording.time, time, complete)
    said += words_of_second(robot, recording, cutoff_hz)
    if complete is not None and recording.time is time:  # the rows are those of the log
        put_back(recording, written_there, complete)
    return recording, there, (*read, *held, *wrong, *odd, *even.words, *said)


def _said_of_flags(name: str, time: FloatArray, complete: BoolArray) -> tuple[str, ...]:
    """A sentence on rows that some drive did not answer."""
    bad = np.asarray(~complete.all(axis=1))
    count = int(np.count_nonzero(bad))
    if not count:
        return ()
    first = seconds(time[int(np.argmax(bad))])
    return (
        f"{name}: {count} of {len(bad)} samples are flagged as not complete (first at {first} s): not used,"
        " and the log is cut there",
    )


def kept_rows(
    name: str, time: FloatArray, position: FloatArray, signal: FloatArray | None = None
) -> tuple[BoolArray, tuple[str, ...]]:
    """Which rows are samples: not those written twice, not those in which a channel is stuck; and sentences.

    Args:
        name: of the log, for messages.
        time: (samples,) s.
        position: samples × joints.
        signal: samples × drives; not looked at where None.
    """
    twice = np.zeros(len(time), dtype=np.bool_)
    twice[1:] = time[1:] == time[:-1]
    for column in (*position.T, *([] if signal is None else signal.T)):
        twice[1:] &= column[1:] == column[:-1]
    again = repeated(position) & ~twice
    kept, words = ~twice, list[str]()
    for rows, what in ((twice, "are written twice"), (again, "repeat the one before while the arm moves")):
        if rows.any():
            at = time[int(np.argmax(rows))]
            words.append(f"{name}: {np.count_nonzero(rows)} rows {what} (first at {seconds(at)} s), left out")
    for what, values in (("position", position), ("control signal", signal)):
        if values is None:
            continue
        once = ~twice if twice.any() else slice(None)
        good, said = not_held(name, what, time[once], values[once], position[once])
        kept[~twice] &= good
        words += said
    kept &= ~again
    return kept, tuple(words)
