"""Several datagrams in one system call (``sendmmsg`` of Linux): the RPDOs of a cycle leave together.

One call instead of one per drive spares the receiving side as many wake-ups.
"""

from __future__ import annotations

import ctypes
import socket
import sys
from collections.abc import Sequence


class _Vector(ctypes.Structure):
    _fields_ = (("base", ctypes.c_void_p), ("size", ctypes.c_size_t))


class _Header(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_void_p),
        ("name_size", ctypes.c_uint32),
        ("vectors", ctypes.POINTER(_Vector)),
        ("count", ctypes.c_size_t),
        ("control", ctypes.c_void_p),
        ("control_size", ctypes.c_size_t),
        ("flags", ctypes.c_int),
    )


class _Message(ctypes.Structure):
    _fields_ = (("header", _Header), ("sent", ctypes.c_uint32))


class DatagramBatch:
    """Datagrams that differ from call to call in their payloads alone.

    Args:
        sock: where they are sent; connected, or of a kind that needs no address.
        frames: per datagram, what comes before its payload and after it.
        size: of each payload, bytes.
    """

    def __init__(self, sock: socket.socket, frames: Sequence[tuple[bytes, bytes]], size: int) -> None:
        self._socket = sock
        self._size = size
        self._buffers = [
            ctypes.create_string_buffer(a + bytes(size) + b, len(a) + size + len(b)) for a, b in frames
        ]
        self._places = [
            (memoryview(buffer).cast("B"), len(a))
            for buffer, (a, _) in zip(self._buffers, frames, strict=True)
        ]
        self._vectors = [_Vector(ctypes.addressof(buffer), len(buffer)) for buffer in self._buffers]
        self._messages = (_Message * len(frames))()
        for message, vector in zip(self._messages, self._vectors, strict=True):
            message.header.vectors = ctypes.pointer(vector)
            message.header.count = 1
        self._call = ctypes.CDLL(None, use_errno=True).sendmmsg if sys.platform == "linux" else None

    def send(self, payloads: Sequence[bytes]) -> int:
        """Send one payload in each datagram.

        Returns:
            How many the system refused.
        """
        size = self._size
        for (view, start), payload in zip(self._places, payloads, strict=True):
            view[start : start + size] = payload
        if self._call is None:
            return self._one_by_one()
        sent: int = self._call(
            self._socket.fileno(), self._messages, len(self._messages), socket.MSG_DONTWAIT
        )
        return len(self._messages) - max(0, sent)

    def _one_by_one(self) -> int:
        refused = 0
        for buffer in self._buffers:
            try:
                self._socket.send(buffer.raw)
            except OSError:
                refused += 1
        return refused
