"""SDO block transfers, server side (CiA 301, 7.2.4.3.9 to 7.2.4.3.16): many segments, one acknowledgement."""

from __future__ import annotations

import binascii
import struct
from collections.abc import Callable

from drivers.simulated.object_dictionary import (
    BLOCK_SEQUENCE,
    BLOCK_SIZE,
    COMMAND_SPECIFIER,
    CRC_ERROR,
    LENGTH_MISMATCH,
    SdoAbort,
)

SEGMENT = 7
LONGEST_BLOCK = 127
"""Segments of one block: the sequence number has seven bits."""
_LAST, _NUMBER = 0x80, 0x7F
_CRC, _SIZE = 0x04, 0x02
_HEADER = struct.Struct("<BHB")


def crc(data: bytes) -> int:
    """CRC-16-CCITT with the start value 0, as CiA 301 7.2.4.3.16 has it."""
    return binascii.crc_hqx(data, 0)


class BlockDownload:
    """A client's block download under way: segments come without an answer until a block is full.

    Args:
        request: the client's first frame.
        index, subindex: what is written.
        write: stores the data when it is whole.
        block: segments per block that the client is asked to send.
    """

    def __init__(
        self,
        request: bytes,
        index: int,
        subindex: int,
        write: Callable[[bytes], None],
        block: int = LONGEST_BLOCK,
    ) -> None:
        self.index, self.subindex = index, subindex
        self._write = write
        self._block = block
        self._checks = bool(request[0] & _CRC)
        self._size = int.from_bytes(request[4:], "little") if request[0] & _SIZE else None
        self._data = bytearray()
        self._good = 0
        """Number of the last segment of this block that came in order."""
        self._seen_last = False
        self.finished = False

    def first_answer(self) -> bytes:
        """Accepts the transfer, and says how many segments make a block."""
        head = _HEADER.pack(0xA0 | _CRC, self.index, self.subindex)
        return head + bytes([self._block, 0, 0, 0])

    def answer(self, frame: bytes) -> tuple[bytes, ...]:
        """The answer to one frame of the client; most have none.

        Raises:
            SdoAbort: the frame is none of this transfer, or the data is not what was announced.
        """
        return self._end(frame) if self._seen_last else self._segment(frame)

    def _segment(self, frame: bytes) -> tuple[bytes, ...]:
        number, last = frame[0] & _NUMBER, bool(frame[0] & _LAST)
        if number == 0:
            raise SdoAbort(BLOCK_SEQUENCE)
        if number == self._good + 1:
            self._good = number
            self._data += frame[1:]
            self._seen_last = last
        if not last and number < self._block:
            return ()
        # Segments after a gap are not taken: the client sends again what follows the acknowledged one.
        answer = bytes([0xA2, self._good, self._block]) + bytes(5)
        self._good = 0
        return (answer,)

    def _end(self, frame: bytes) -> tuple[bytes, ...]:
        if frame[0] & 0xE3 != 0xC1:
            raise SdoAbort(COMMAND_SPECIFIER)
        data = bytes(self._data[: len(self._data) - (frame[0] >> 2 & 0x07)])
        if self._size is not None and len(data) != self._size:
            raise SdoAbort(LENGTH_MISMATCH)
        if self._checks and crc(data) != int.from_bytes(frame[1:3], "little"):
            raise SdoAbort(CRC_ERROR)
        self._write(data)
        self.finished = True
        return (bytes([0xA1]) + bytes(7),)


class BlockUpload:
    """A client's block upload under way: a block of segments goes out for each acknowledgement.

    Args:
        request: the client's first frame.
        index, subindex: what is read.
        data: all of it.

    Raises:
        SdoAbort: the client asks for blocks of no or too many segments.
    """

    def __init__(self, request: bytes, index: int, subindex: int, data: bytes) -> None:
        self.index, self.subindex = index, subindex
        self._block = self._checked(request[4])
        self._checks = bool(request[0] & _CRC)
        self._data = data
        self._at = 0
        """Bytes that the client has acknowledged."""
        self._sent = 0
        """Segments of the block that is on its way; 0 where none is."""
        self._started = self._over = False
        self.finished = False

    def first_answer(self) -> bytes:
        """Says how much there is."""
        head = _HEADER.pack(0xC0 | _CRC | _SIZE, self.index, self.subindex)
        return head + struct.pack("<I", len(self._data))

    def answer(self, frame: bytes) -> tuple[bytes, ...]:
        """The answers to one frame of the client: a block of segments, or the end.

        Raises:
            SdoAbort: the frame is none of this transfer, or acknowledges what was not sent.
        """
        command = frame[0]
        if command == 0xA3 and not self._started:
            self._started = True
            return self._segments()
        if command == 0xA2 and self._sent:
            return self._acknowledged(frame[1], frame[2])
        if command == 0xA1 and self._over:
            self.finished = True
            return ()
        raise SdoAbort(COMMAND_SPECIFIER)

    def _acknowledged(self, number: int, block: int) -> tuple[bytes, ...]:
        if number > self._sent:
            raise SdoAbort(BLOCK_SEQUENCE)
        self._block = self._checked(block)
        self._at = min(self._at + number * SEGMENT, self._whole)
        self._sent = 0
        return self._segments() if self._at < self._whole else self._end()

    @property
    def _whole(self) -> int:
        """Bytes of all segments; there is one at least."""
        return max(1, -(-len(self._data) // SEGMENT)) * SEGMENT

    def _segments(self) -> tuple[bytes, ...]:
        left = (self._whole - self._at) // SEGMENT
        self._sent = min(self._block, left)
        frames = []
        for k in range(self._sent):
            start = self._at + k * SEGMENT
            last = _LAST if k + 1 == left else 0
            frames.append(bytes([last | (k + 1)]) + self._data[start : start + SEGMENT].ljust(SEGMENT, b"\0"))
        return tuple(frames)

    def _end(self) -> tuple[bytes, ...]:
        self._over = True
        unused = self._whole - len(self._data)
        checked = crc(self._data) if self._checks else 0
        return (bytes([0xC1 | unused << 2]) + checked.to_bytes(2, "little") + bytes(5),)

    @staticmethod
    def _checked(block: int) -> int:
        if not 1 <= block <= LONGEST_BLOCK:
            raise SdoAbort(BLOCK_SIZE)
        return block
