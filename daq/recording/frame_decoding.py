"""From datagrams to frames: SocketCAN's ``struct can_frame``, python-can's ``udp_multicast``."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

import can
import msgpack
import numpy as np
from can.interfaces.udp_multicast.utils import pack_message
from numpy.typing import NDArray

from daq.recording.datagrams import SIZE, Datagrams
from daq.recording.frames import Frames

_EXTENDED, _REMOTE, _ERROR = 0x8000_0000, 0x4000_0000, 0x2000_0000
_ID_BITS = 0x1FFF_FFFF
_CAN_FRAME = np.dtype([("id", "<u4"), ("dlc", "u1"), ("gap", "u1", (3,)), ("data", "u1", (8,))])
_LONGEST = 8
_FIRST_MARK = 0x80
"""msgpack writes a number below as a byte of its own."""
_STAMP_BYTES = 8


def decode_socketcan(datagrams: Datagrams) -> Frames:
    """Classical frames; longer ones (CAN FD) are passed over."""
    good = datagrams.size == _CAN_FRAME.itemsize
    raw = np.ascontiguousarray(datagrams.data[good, : _CAN_FRAME.itemsize]).view(_CAN_FRAME)[:, 0]
    return _frames(
        datagrams.stamp[good],
        raw["id"].astype(np.uint32),
        np.minimum(raw["dlc"], _LONGEST).astype(np.uint8),
        raw["data"],
    )


def _frames(
    stamp: NDArray[np.int64], flagged: NDArray[np.uint32], dlc: NDArray[np.uint8], data: NDArray[np.uint8]
) -> Frames:
    return Frames(
        stamp=stamp,
        can_id=flagged & np.uint32(_ID_BITS),
        is_rtr=(flagged & np.uint32(_REMOTE)) != 0,
        is_extended=(flagged & np.uint32(_EXTENDED)) != 0,
        is_error=(flagged & np.uint32(_ERROR)) != 0,
        dlc=dlc,
        data=np.where(np.arange(_LONGEST) < dlc[:, np.newaxis], data, np.uint8(0)),
    )


@dataclass(frozen=True)
class _Template:
    """Where the bytes of a data frame are in a datagram of one length, and what the others must be."""

    mask: NDArray[np.uint64]
    expected: NDArray[np.uint64]
    """Both over the words of a datagram: eight bytes are compared at a time."""
    short_id: bool
    """The id is one byte without a mark of msgpack before it."""
    id_bytes: NDArray[np.intp]
    payload: NDArray[np.intp]


class MulticastDecoder:
    """python-can's datagrams: msgpack maps that differ from frame to frame in few bytes.

    Those that look like a template in all other bytes are read as arrays; everything else, such as error
    frames, goes through msgpack one by one.
    """

    def __init__(self) -> None:
        self._templates: dict[int, list[_Template]] = {}
        for size in range(_LONGEST + 1):
            # msgpack writes an id of 11 bits in one, two or three bytes.
            for low, high in ((0x100, 0x7FF), (0x80, 0xFF), (0x00, 0x7F)):
                length, template = _template(low, high, size)
                self._templates.setdefault(length, []).append(template)

    def decode(self, datagrams: Datagrams) -> Frames:
        """The classical frames among them; what is none is passed over."""
        count = len(datagrams.size)
        flagged = np.zeros(count, dtype=np.uint32)
        dlc = np.zeros(count, dtype=np.uint8)
        data = np.zeros((count, _LONGEST), dtype=np.uint8)
        known = np.zeros(count, dtype=np.bool_)
        words = datagrams.data.view(np.uint64)
        for length in np.unique(datagrams.size).tolist():
            rows = np.flatnonzero(datagrams.size == length)
            for template in self._templates.get(length, ()):
                if not len(rows):
                    break
                fits = ((words[rows] ^ template.expected) & template.mask == 0).all(axis=1)
                if template.short_id:
                    fits &= datagrams.data[rows, template.id_bytes[0]] < _FIRST_MARK
                hits = rows[fits]
                table = datagrams.data[hits]
                for column in template.id_bytes:
                    flagged[hits] = (flagged[hits] << np.uint32(8)) | table[:, column]
                size = len(template.payload)
                dlc[hits] = size
                data[hits, :size] = table[:, template.payload]
                known[hits] = True
                rows = rows[~fits]
        good = known.copy()
        for row in np.flatnonzero(~known):
            frame = _unpacked(datagrams.data[row, : datagrams.size[row]].tobytes())
            if frame is not None:
                flagged[row], payload = frame
                dlc[row] = len(payload)
                data[row, : len(payload)] = np.frombuffer(payload, dtype=np.uint8)
                good[row] = True
        return _frames(datagrams.stamp[good], flagged[good], dlc[good], data[good])


def _template(low: int, high: int, size: int) -> tuple[int, _Template]:
    """Length and places, found by packing two frames that differ in every byte that may differ."""
    stamps = (0.0, struct.unpack(">d", b"\x41" * _STAMP_BYTES)[0])
    first, second = (
        np.frombuffer(_packed(stamp, cob_id, bytes([fill] * size)), dtype=np.uint8)
        for stamp, cob_id, fill in ((stamps[0], low, 0x00), (stamps[1], high, 0xFF))
    )
    variable = np.flatnonzero(first != second)
    mask, expected = np.zeros(SIZE, dtype=np.uint8), np.zeros(SIZE, dtype=np.uint8)
    mask[np.flatnonzero(first == second)] = 0xFF
    expected[: len(first)] = first
    return len(first), _Template(
        mask=mask.view(np.uint64),
        expected=expected.view(np.uint64),
        short_id=high < _FIRST_MARK,
        id_bytes=variable[_STAMP_BYTES : len(variable) - size],
        payload=variable[len(variable) - size :],
    )


def _packed(stamp: float, cob_id: int, data: bytes) -> bytes:
    message = can.Message(timestamp=stamp, arbitration_id=cob_id, data=data, is_extended_id=False)
    return bytes(pack_message(message))


def _unpacked(datagram: bytes) -> tuple[int, bytes] | None:
    """Id with SocketCAN's flags, and payload; None where it is no classical frame."""
    try:
        fields: Any = msgpack.unpackb(datagram)
        cob_id, payload = fields["arbitration_id"], fields["data"]
        flags = (
            (fields["is_extended_id"], _EXTENDED),
            (fields["is_remote_frame"], _REMOTE),
            (fields["is_error_frame"], _ERROR),
        )
        usable = not fields["is_fd"] and isinstance(cob_id, int) and isinstance(payload, bytes)
    except (ValueError, TypeError, KeyError, RecursionError, msgpack.UnpackException):
        return None
    if not usable or not 0 <= cob_id <= _ID_BITS or len(payload) > _LONGEST:
        return None
    return cob_id | sum(bit for flag, bit in flags if flag), payload
