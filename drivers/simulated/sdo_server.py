"""The SDO server of one simulated drive: expedited and segmented transfers (CiA 301, 7.2.4)."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from drivers.simulated.object_dictionary import (
    COMMAND_SPECIFIER,
    LENGTH_MISMATCH,
    TOGGLE_BIT,
    ObjectDictionary,
    SdoAbort,
)

_HEADER = struct.Struct("<BHB")
_ABORT = struct.Struct("<BHBI")
_SEGMENT = 7


@dataclass
class _Transfer:
    """A segmented transfer under way."""

    index: int
    subindex: int
    upload: bool
    data: bytearray = field(default_factory=bytearray)
    size: int | None = None
    toggle: int = 0


class SdoServer:
    """Answers SDO requests from an object dictionary, one frame in, at most one frame out."""

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self._dictionary = dictionary
        self._transfer: _Transfer | None = None

    def reset(self) -> None:
        """Forgets a transfer under way."""
        self._transfer = None

    def answer(self, request: bytes) -> bytes | None:
        """The response to one request of 8 bytes; None where none is due."""
        if len(request) != 8:
            return None
        command, index, subindex = _HEADER.unpack_from(request)
        kind = command >> 5
        if kind == 4:  # the client aborts
            self._transfer = None
            return None
        if kind in (0, 3) and self._transfer is not None:
            index, subindex = self._transfer.index, self._transfer.subindex
        try:
            if kind == 1:
                return self._start_download(request, index, subindex)
            if kind == 2:
                return self._start_upload(index, subindex)
            if kind == 0:
                return self._download_segment(request)
            if kind == 3:
                return self._upload_segment(command)
            raise SdoAbort(COMMAND_SPECIFIER)
        except SdoAbort as abort:
            self._transfer = None
            return _ABORT.pack(0x80, index, subindex, abort.code)

    def _start_download(self, request: bytes, index: int, subindex: int) -> bytes:
        self._transfer = None
        command = request[0]
        expedited, sized = command & 0x02, command & 0x01
        if expedited:
            length = 4 - (command >> 2 & 0x03) if sized else None
            self._dictionary.write(index, subindex, self._expedited(request, index, subindex, length))
        else:
            self._dictionary.entry(index, subindex)
            size = int.from_bytes(request[4:], "little") if sized else None
            self._transfer = _Transfer(index, subindex, upload=False, size=size)
        return _HEADER.pack(0x60, index, subindex) + bytes(4)

    def _expedited(self, request: bytes, index: int, subindex: int, length: int | None) -> bytes:
        if length is None:  # no size given: as many bytes as the object has
            length = self._dictionary.entry(index, subindex).bits // 8 or 4
        return request[4 : 4 + length]

    def _download_segment(self, request: bytes) -> bytes:
        transfer = self._expect(request[0], upload=False)
        command = request[0]
        transfer.data += request[1 : 1 + _SEGMENT - (command >> 1 & 0x07)]
        toggle = transfer.toggle
        transfer.toggle ^= 0x10
        if command & 0x01:
            self._transfer = None
            if transfer.size is not None and transfer.size != len(transfer.data):
                self._transfer = None
                raise SdoAbort(LENGTH_MISMATCH)
            self._dictionary.write(transfer.index, transfer.subindex, bytes(transfer.data))
        return bytes([0x20 | toggle]) + bytes(7)

    def _start_upload(self, index: int, subindex: int) -> bytes:
        self._transfer = None
        data = self._dictionary.read(index, subindex)
        if len(data) in (1, 2, 3, 4):
            command = 0x43 | (4 - len(data)) << 2
            return _HEADER.pack(command, index, subindex) + data.ljust(4, b"\0")
        self._transfer = _Transfer(index, subindex, upload=True, data=bytearray(data))
        return _HEADER.pack(0x41, index, subindex) + struct.pack("<I", len(data))

    def _upload_segment(self, command: int) -> bytes:
        transfer = self._expect(command, upload=True)
        part = bytes(transfer.data[:_SEGMENT])
        del transfer.data[:_SEGMENT]
        last = not transfer.data
        answer = transfer.toggle | (_SEGMENT - len(part)) << 1 | int(last)
        transfer.toggle ^= 0x10
        if last:
            self._transfer = None
        return bytes([answer]) + part.ljust(_SEGMENT, b"\0")

    def _expect(self, command: int, upload: bool) -> _Transfer:
        transfer = self._transfer
        if transfer is None or transfer.upload != upload:
            raise SdoAbort(COMMAND_SPECIFIER)
        if command & 0x10 != transfer.toggle:
            raise SdoAbort(TOGGLE_BIT)
        return transfer
