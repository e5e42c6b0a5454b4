"""``sensor_msgs/JointState`` out of MCAP files, ROS 2 and ROS 1 bags, as named columns.

Columns are ``TOPIC/position/JOINT``, ``TOPIC/velocity/JOINT`` and ``TOPIC/effort/JOINT``; ``TOPIC/stamp`` is
the time in the messages' headers and ``TOPIC/log_time`` the one at which they were recorded, both in s since
the first message of the file.
"""

from __future__ import annotations

import logging
import sqlite3
import struct
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import zstandard
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from numpy.typing import NDArray

from daq.importing.bags import ROS1_SUFFIX, ROS2_SUFFIXES, SQLITE_SUFFIX
from daq.importing.rosbag1 import in_rosbag1
from daq.recording.cdr import CdrError
from daq.recording.errors import CaptureError
from daq.recording.messages import JointState, decode_joint_state

log = logging.getLogger(__name__)

JOINT_STATE_TYPES = ("sensor_msgs/msg/JointState", "sensor_msgs/JointState")
_LARGEST_RECORD = 1 << 28

_Logged = tuple[str, int, bytes]
"""Topic, time of recording in ns, message."""


def bag_files(path: Path) -> list[Path]:
    """The files of a bag, in their order: a bag may be split."""
    return sorted(file for file in path.iterdir() if file.suffix in ROS2_SUFFIXES)


def read_bag(path: Path) -> dict[str, NDArray[np.float64]]:
    """Columns of all JointState topics of a file, or of a folder with a bag.

    Raises:
        CaptureError: it cannot be read, or holds no JointState.
        OSError: it cannot be opened.
    """
    files = bag_files(path) if path.is_dir() else [path]
    messages: dict[str, list[tuple[int, JointState]]] = defaultdict(list)
    for file in files:
        for topic, time, state in in_rosbag1(file) if file.suffix == ROS1_SUFFIX else _in_cdr(file):
            messages[topic].append((time, state))
    if not messages:
        raise CaptureError(f"{path}: holds no {JOINT_STATE_TYPES[0]}, as CDR or of ROS 1")
    origins = [_time_of(time, state) for rows in messages.values() for time, state in rows[:1]]
    columns: dict[str, NDArray[np.float64]] = {}
    for topic, rows in messages.items():
        columns |= _columns(path, topic, rows, min(origins))
    return columns


def _in_cdr(file: Path) -> Iterator[tuple[str, int, JointState]]:
    """Topic, time of recording in ns, and message of a file of ROS 2.

    Raises:
        CaptureError: a message cannot be read.
    """
    for topic, time, data in _in_sqlite(file) if file.suffix == SQLITE_SUFFIX else _in_mcap(file):
        try:
            yield topic, time, decode_joint_state(data)
        except CdrError as error:
            raise CaptureError(f"{file}: a message of {topic} is no JointState: {error}") from error


def _time_of(logged: int, state: JointState) -> int:
    return state.stamp or logged


def _columns(
    path: Path, topic: str, rows: list[tuple[int, JointState]], origin: int
) -> dict[str, NDArray[np.float64]]:
    """The columns of one topic, from the messages that name the usual set of joints."""
    sets = Counter(frozenset(state.name) for _, state in rows)
    usual, count = sets.most_common(1)[0]
    if count < len(rows):
        log.warning(
            "%s: %d of %d messages of %s name other joints and are left out",
            path,
            len(rows) - count,
            len(rows),
            topic,
        )
    chosen = [(time, state) for time, state in rows if frozenset(state.name) == usual]
    first = chosen[0][1].name
    columns = {
        f"{topic}/stamp": np.array([(_time_of(time, state) - origin) * 1e-9 for time, state in chosen]),
        f"{topic}/log_time": np.array([(time - origin) * 1e-9 for time, _ in chosen]),
    }
    for field in ("position", "velocity", "effort"):
        values = [_in_order(getattr(state, field), state.name, first) for _, state in chosen]
        if all(row is not None for row in values):
            table = np.array(values, dtype=np.float64)
            columns |= {f"{topic}/{field}/{name}": table[:, k].copy() for k, name in enumerate(first)}
    return columns


def _in_order(
    values: tuple[float, ...], names: tuple[str, ...], wanted: tuple[str, ...]
) -> list[float] | None:
    """Values by name in the wanted order; None where the message has none of this field."""
    if len(values) != len(names) or not names:
        return None
    by_name = dict(zip(names, values, strict=True))
    return [by_name[name] for name in wanted]


def _in_mcap(path: Path) -> Iterator[_Logged]:
    errors = (
        McapError,
        ValueError,
        struct.error,
        LookupError,
        TypeError,
        RuntimeError,
        MemoryError,
        OverflowError,
        zstandard.ZstdError,
    )
    try:
        with path.open("rb") as file:
            reader = NonSeekingReader(file, validate_crcs=True, record_size_limit=_LARGEST_RECORD)
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                named = schema is not None and schema.name in JOINT_STATE_TYPES
                if named and channel.message_encoding == "cdr":
                    yield channel.topic, message.log_time, message.data
    except errors as error:
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise CaptureError(f"{path}: is not an MCAP file that can be read to its end: {reason}") from error


def _in_sqlite(path: Path) -> Iterator[_Logged]:
    query = (
        "SELECT topics.name, messages.timestamp, messages.data FROM messages"
        " JOIN topics ON messages.topic_id = topics.id"
        " WHERE topics.type IN (?, ?) AND topics.serialization_format = 'cdr' ORDER BY messages.timestamp"
    )
    try:
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
        try:
            for topic, time, data in connection.execute(query, JOINT_STATE_TYPES):
                if not (isinstance(topic, str) and isinstance(time, int) and isinstance(data, bytes)):
                    raise CaptureError(f"{path}: is not a ROS 2 bag: a message is not what its table says")
                yield topic, time, data
        finally:
            connection.close()
    except (sqlite3.Error, UnicodeDecodeError, OverflowError) as error:
        raise CaptureError(
            f"{path}: is not a ROS 2 bag that can be read: {' '.join(str(error).split())}"
        ) from error
