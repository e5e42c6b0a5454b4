"""A ring of sample rows in shared memory: the cyclic process writes, its parent reads.

One writer and one reader, no locks: each counter is one aligned 64-bit word that only one side writes,
and a row is complete before the writer's counter passes it. The memory is an unlinked file, so it
is gone with the last process that has it open.
"""

from __future__ import annotations

import mmap
import os
import struct
import tempfile
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


class Request(IntEnum):
    """What the arm shall do; a more urgent one overrules the others."""

    PAUSE_AFTER = 1
    """Finish the period, then as a pause."""
    PAUSE = 2
    """Come to rest now, along the path, and hold there until resumed."""
    STOP = 3
    """Finish the period, come to rest, disable."""
    ABORT = 4
    """Come to rest now, on a ramp at the acceleration limits, and disable."""
    HALT = 5
    """Quick stop now, by the drives themselves (605Ah), and disable."""


_WRITTEN, _READ, _PAUSE, _FINISH, _ABORT, _HALT, _PAUSE_AFTER = range(7)
_WORDS = {
    Request.PAUSE_AFTER: _PAUSE_AFTER,
    Request.PAUSE: _PAUSE,
    Request.STOP: _FINISH,
    Request.ABORT: _ABORT,
    Request.HALT: _HALT,
}
_HEADER_WORDS = 8
_HEADER_BYTES = 8 * _HEADER_WORDS


def row_layout(n: int) -> tuple[struct.Struct, np.dtype[Any]]:
    """A row as the writer packs it and as the reader sees it; counts and raw values, n axes each."""
    layout = struct.Struct(f"=qd{n}i{n}i{n}i{n}i{n}H{n}?")
    columns = np.dtype(
        [
            ("cycle", "i8"),
            ("lateness", "f8"),
            ("target", "i4", (n,)),
            ("position", "i4", (n,)),
            ("control_signal", "i4", (n,)),
            ("velocity", "i4", (n,)),
            ("statusword", "u2", (n,)),
            ("complete", "?", (n,)),
        ]
    )
    return layout, columns


def _unnamed_file() -> int:
    """A file without a name: nothing is left behind, whoever is killed."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("armhil-ring")
    descriptor, name = tempfile.mkstemp()
    Path(name).unlink()
    return descriptor


class Ring:
    """Rows of n axes; made by the parent with :meth:`create`, opened by the child from the descriptor.

    Args:
        descriptor: of the shared memory; closed with the ring.
        n: axes.
        capacity: rows.
    """

    def __init__(self, descriptor: int, n: int, capacity: int) -> None:
        self.descriptor = descriptor
        self.capacity = capacity
        self._layout, self._columns = row_layout(n)
        self._map = mmap.mmap(descriptor, self.size(n, capacity))
        self._view = memoryview(self._map)
        self._words = self._view[:_HEADER_BYTES].cast("Q")

    @staticmethod
    def size(n: int, capacity: int) -> int:
        """Bytes of a ring."""
        return _HEADER_BYTES + capacity * row_layout(n)[0].size

    @classmethod
    def create(cls, n: int, capacity: int) -> Ring:
        """A new, empty ring."""
        descriptor = _unnamed_file()
        os.ftruncate(descriptor, cls.size(n, capacity))
        return cls(descriptor, n, capacity)

    def write(self, *row: int | float) -> bool:
        """Append one row, in the order of row_layout; False where the ring is full."""
        written = self._words[_WRITTEN]
        if written - self._words[_READ] >= self.capacity:
            return False
        offset = _HEADER_BYTES + (written % self.capacity) * self._layout.size
        self._layout.pack_into(self._map, offset, *row)
        self._words[_WRITTEN] = written + 1
        return True

    def read(self) -> NDArray[Any]:
        """A copy of the rows written since the last call, as a structured array."""
        written, read = self._words[_WRITTEN], self._words[_READ]
        rows: NDArray[Any] = np.frombuffer(
            self._view, dtype=self._columns, count=self.capacity, offset=_HEADER_BYTES
        )
        copied = rows[np.arange(read, written) % self.capacity]
        self._words[_READ] = written
        return copied

    def request(self, request: Request) -> None:
        """Ask the writer to end, or to pause; requests of different kinds stand beside each other."""
        self._words[_WORDS[request]] = 1

    def resume(self) -> None:
        """Take a pause back."""
        self._words[_PAUSE] = self._words[_PAUSE_AFTER] = 0

    def requested(self) -> Request | None:
        """The most urgent request that stands."""
        words = self._words
        if words[_HALT]:
            return Request.HALT
        if words[_ABORT]:
            return Request.ABORT
        if words[_FINISH]:
            return Request.STOP
        if words[_PAUSE]:
            return Request.PAUSE
        return Request.PAUSE_AFTER if words[_PAUSE_AFTER] else None

    def close(self) -> None:
        self._words.release()
        self._view.release()
        self._map.close()
        os.close(self.descriptor)
