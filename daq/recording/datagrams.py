"""Many datagrams in one system call, with the kernel's time of arrival (``recvmmsg`` of Linux)."""

from __future__ import annotations

import ctypes
import socket
import sys
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SIZE = 256
"""Bytes kept of one datagram: python-can's take some 150, a SocketCAN frame 16."""
MOST = 512
"""Datagrams of one call."""

# Linux numbers that Python's socket module does not carry.
_SO_TIMESTAMPNS = 35

_VECTOR = np.dtype([("base", "u8"), ("size", "u8")])
_HEADER = np.dtype(
    [
        ("name", "u8"),
        ("name_size", "u4"),
        ("gap1", "u4"),
        ("vectors", "u8"),
        ("count", "u8"),
        ("control", "u8"),
        ("control_size", "u8"),
        ("flags", "u4"),
        ("gap2", "u4"),
        ("received", "u4"),
        ("gap3", "u4"),
    ]
)
"""``struct mmsghdr`` of a 64-bit Linux."""
_CONTROL = np.dtype([("size", "u8"), ("level", "i4"), ("kind", "i4"), ("sec", "i8"), ("nanosec", "i8")])
"""``struct cmsghdr`` with a ``struct timespec``."""


@dataclass(frozen=True)
class Datagrams:
    """N datagrams."""

    stamp: NDArray[np.int64]
    """(N,) ns since the epoch."""
    size: NDArray[np.int64]
    """(N,) bytes."""
    data: NDArray[np.uint8]
    """N × SIZE; valid up to ``size``, and until the next call."""


class DatagramReader:
    """Takes what has come on a socket, without waiting.

    Args:
        sock: opened; it is used, not closed.
    """

    def __init__(self, sock: socket.socket) -> None:
        self._socket = sock
        self._data = np.zeros((MOST, SIZE), dtype=np.uint8)
        self._stamped = sys.platform == "linux" and sys.maxsize > 2**32
        if self._stamped:
            sock.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            self._prepare()

    def _prepare(self) -> None:
        self._control = np.zeros(MOST, dtype=_CONTROL)
        self._vectors = np.zeros(MOST, dtype=_VECTOR)
        self._headers = np.zeros(MOST, dtype=_HEADER)
        steps = np.arange(MOST, dtype=np.uint64)
        self._vectors["base"] = self._data.ctypes.data + steps * np.uint64(SIZE)
        self._vectors["size"] = SIZE
        self._headers["vectors"] = self._vectors.ctypes.data + steps * np.uint64(_VECTOR.itemsize)
        self._headers["count"] = 1
        self._headers["control"] = self._control.ctypes.data + steps * np.uint64(_CONTROL.itemsize)
        self._call = ctypes.CDLL(None, use_errno=True).recvmmsg
        self._call.argtypes = [
            ctypes.c_int,
            ctypes.c_void_p,
            ctypes.c_uint,
            ctypes.c_int,
            ctypes.c_void_p,
        ]

    def read(self) -> Datagrams:
        """Up to MOST datagrams; none where none has come.

        Raises:
            OSError: the socket fails.
        """
        return self._read_many() if self._stamped else self._read_one_by_one()

    def _read_many(self) -> Datagrams:
        self._headers["control_size"] = _CONTROL.itemsize
        self._control["kind"] = 0
        got: int = self._call(
            self._socket.fileno(), self._headers.ctypes.data, MOST, socket.MSG_DONTWAIT, None
        )
        if got < 0:
            number = ctypes.get_errno()
            if number not in _NOTHING_THERE:
                raise OSError(number, "failed to receive")
            got = 0
        control = self._control[:got]
        stamp = control["sec"] * 1_000_000_000 + control["nanosec"]
        stamp[control["kind"] != _SO_TIMESTAMPNS] = time.time_ns()
        # Until the kernel has begun to stamp on arrival it stamps when a frame is fetched; but none has come
        # after the one behind it in the queue.
        stamp = np.minimum.accumulate(stamp[::-1])[::-1]
        size = self._headers["received"][:got].astype(np.int64)
        return Datagrams(stamp, size, self._data[:got])

    def _read_one_by_one(self) -> Datagrams:
        sizes: list[int] = []
        stamps: list[int] = []
        try:
            while len(sizes) < MOST:
                view = memoryview(self._data[len(sizes)])
                sizes.append(self._socket.recv_into(view, SIZE, socket.MSG_DONTWAIT))
                stamps.append(time.time_ns())
        except BlockingIOError:
            pass
        return Datagrams(np.array(stamps, np.int64), np.array(sizes, np.int64), self._data[: len(sizes)])


_NOTHING_THERE = (4, 11)
"""EINTR and EAGAIN."""
