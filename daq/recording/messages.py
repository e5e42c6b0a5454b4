"""The messages of a capture: vectorised encoding of many at once.

Within one capture the joint names never change, so every message of a channel has the same length
and its numbers sit at the same bytes. A batch of samples is then one structured NumPy array laid over
copies of a template, which costs well under a microsecond a message.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.recording.cdr import CdrDecoder, CdrEncoder
from daq.recording.mcap_file import Rows

_FORMATS = {
    "bool": "?",
    "uint8": "u1",
    "uint16": "<u2",
    "int32": "<i4",
    "uint32": "<u4",
    "uint64": "<u8",
    "float64": "<f8",
}


@dataclass(frozen=True)
class Layout:
    """A message whose strings and lengths are fixed: a template, and where its numbers are."""

    template: bytes
    dtype: np.dtype[np.void]

    def rows(self, stamps: NDArray[np.int64], columns: Mapping[str, NDArray[Any]]) -> Rows:
        """Messages of N samples, N × size.

        Args:
            stamps: (N,) time of each message, ns since the epoch.
            columns: field name → (N,) or (N, n) values.
        """
        rows = np.empty((len(stamps), len(self.template)), dtype=np.uint8)
        rows[:] = np.frombuffer(self.template, dtype=np.uint8)
        records = rows.view(self.dtype)[:, 0]
        records["sec"], records["nanosec"] = np.divmod(stamps, 1_000_000_000)
        for name, values in columns.items():
            records[name] = values
        return rows

    def decode(self, rows: Rows) -> NDArray[np.void] | None:
        """The numbers of N messages, (N,) structured; None where one does not fit the template."""
        size = len(self.template)
        if rows.shape[1] != size:
            return None
        constant = np.ones(size, dtype=bool)
        for form, offset, *_ in (self.dtype.fields or {}).values():
            constant[offset : offset + form.itemsize] = False
        fixed = np.frombuffer(self.template, dtype=np.uint8)[constant]
        if not np.array_equal(rows[:, constant], np.broadcast_to(fixed, (len(rows), fixed.size))):
            return None
        return np.ascontiguousarray(rows).view(self.dtype)[:, 0]


class _LayoutBuilder:
    """Encodes a template with zeros for numbers and notes where each number went."""

    def __init__(self) -> None:
        self.encoder = CdrEncoder()
        self._fields: list[tuple[str, str | tuple[str, tuple[int]], int]] = []
        self.number("sec", "int32")
        self.number("nanosec", "uint32")
        self.encoder.string("")

    def number(self, name: str, kind: str) -> None:
        self.encoder.primitive(kind, 0)
        self._fields.append((name, _FORMATS[kind], self.encoder.offset))

    def numbers(self, name: str, kind: str, count: int) -> None:
        self.encoder.sequence(kind, [0] * count)
        if count:
            self._fields.append((name, (_FORMATS[kind], (count,)), self.encoder.offset))

    def array(self, name: str, kind: str, count: int) -> None:
        """An array of fixed length: no count in front of it."""
        self.encoder.primitive(kind, 0)
        begin = self.encoder.offset
        for _ in range(count - 1):
            self.encoder.primitive(kind, 0)
        self._fields.append((name, (_FORMATS[kind], (count,)), begin))

    def finish(self) -> Layout:
        template = self.encoder.finish()
        dtype = np.dtype(
            {
                "names": [name for name, *_ in self._fields],
                "formats": [form for _, form, _ in self._fields],
                "offsets": [offset for *_, offset in self._fields],
                "itemsize": len(template),
            }
        )
        return Layout(template, dtype)


def joint_state_layout(names: Sequence[str], *, velocity: bool = False, effort: bool = False) -> Layout:
    """Layout of a JointState with a position, and a velocity and an effort where asked for."""
    builder = _LayoutBuilder()
    builder.encoder.strings(names)
    builder.numbers("position", "float64", len(names))
    builder.numbers("velocity", "float64", len(names) if velocity else 0)
    builder.numbers("effort", "float64", len(names) if effort else 0)
    return builder.finish()


def cycle_status_layout(names: Sequence[str], *, following_error: bool = True) -> Layout:
    """Layout of the per-cycle message; captures of the first version have no following error in it."""
    builder = _LayoutBuilder()
    builder.number("cycle", "uint64")
    builder.number("lateness", "float64")
    builder.encoder.strings(names)
    builder.numbers("control_signal", "float64", len(names))
    builder.numbers("statusword", "uint16", len(names))
    builder.numbers("complete", "bool", len(names))
    if following_error:
        builder.numbers("following_error", "float64", len(names))
    return builder.finish()


def joint_channels_layout(names: Sequence[str], channels: Sequence[str], present: Sequence[str]) -> Layout:
    """Layout of further channels of the joints; those that are not present are empty."""
    builder = _LayoutBuilder()
    builder.encoder.strings(names)
    for channel in channels:
        builder.numbers(channel, "float64", len(names) if channel in present else 0)
    return builder.finish()


def frame_layout() -> Layout:
    """Layout of a ``can_msgs/Frame``."""
    builder = _LayoutBuilder()
    builder.number("id", "uint32")
    for name in ("is_rtr", "is_extended", "is_error"):
        builder.number(name, "bool")
    builder.number("dlc", "uint8")
    builder.array("data", "uint8", 8)
    return builder.finish()


@dataclass(frozen=True)
class JointState:
    """One ``sensor_msgs/JointState``, from whoever wrote it."""

    stamp: int
    name: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]


def decode_joint_state(data: bytes) -> JointState:
    """Read any JointState.

    Raises:
        daq.recording.cdr.CdrError: the bytes are not a JointState.
    """
    decoder = CdrDecoder(data)
    seconds, nanoseconds = int(decoder.primitive("int32")), int(decoder.primitive("uint32"))
    decoder.string()
    return JointState(
        stamp=seconds * 1_000_000_000 + nanoseconds,
        name=tuple(decoder.strings()),
        position=tuple(decoder.sequence("float64")),
        velocity=tuple(decoder.sequence("float64")),
        effort=tuple(decoder.sequence("float64")),
    )
