"""The SDO server of one simulated drive: expedited, segmented and block transfers (CiA 301, 7.2.4)."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from functools import partial

from drivers.simulated.object_dictionary import (
    COMMAND_SPECIFIER,
    LENGTH_MISMATCH,
    TOGGLE_BIT,
    ObjectDictionary,
    SdoAbort,
)
from drivers.simulated.sdo_block import BlockDownload, BlockUpload

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
    """Answers SDO requests from an object dictionary, frame by frame.

    Args:
        dictionary: of the node.
        sized: whether expedited answers say how many bytes they carry.
    """

    def __init__(self, dictionary: ObjectDictionary, *, sized: bool = True) -> None:
        self._dictionary, self._sized = dictionary, sized
        self._transfer: _Transfer | None = None
        self._block: BlockDownload | BlockUpload | None = None

    def reset(self) -> None:
        """Forgets a transfer under way."""
        self._transfer = self._block = None

    def answer(self, request: bytes) -> tuple[bytes, ...]:
        """The responses to one request of 8 bytes: none, one, or the segments of a block."""
        if len(request) != 8:
            return ()
        command, index, subindex = _HEADER.unpack_from(request)
        if command == 0x80:  # the client aborts
            self.reset()
            return ()
        under_way = self._block or self._transfer
        if under_way is not None and (self._block or command >> 5 in (0, 3)):
            index, subindex = under_way.index, under_way.subindex
        try:
            return self._block_frame(request) if self._block else self._single(request, index, subindex)
        except SdoAbort as abort:
            self.reset()
            return (_ABORT.pack(0x80, index, subindex, abort.code),)

    def _single(self, request: bytes, index: int, subindex: int) -> tuple[bytes, ...]:
        """One request outside a block transfer."""
        command = request[0]
        kind = command >> 5
        if kind == 1:
            return (self._start_download(request, index, subindex),)
        if kind == 2:
            return (self._start_upload(index, subindex),)
        if kind == 0:
            return (self._download_segment(request),)
        if kind == 3:
            return (self._upload_segment(command),)
        if kind == 6 and not command & 0x01:
            return (self._start_block_download(request, index, subindex),)
        if kind == 5 and not command & 0x03:
            return (self._start_block_upload(request, index, subindex),)
        raise SdoAbort(COMMAND_SPECIFIER)

    def _start_block_download(self, request: bytes, index: int, subindex: int) -> bytes:
        self._transfer = None
        self._dictionary.entry(index, subindex)
        write = partial(self._dictionary.write, index, subindex)
        self._block = BlockDownload(request, index, subindex, write)
        return self._block.first_answer()

    def _start_block_upload(self, request: bytes, index: int, subindex: int) -> bytes:
        self._transfer = None
        data = self._dictionary.read(index, subindex)
        if len(data) <= request[5]:
            # Below the client's threshold the server may change to an ordinary transfer (7.2.4.3.13).
            return self._start_upload(index, subindex)
        self._block = BlockUpload(request, index, subindex, data)
        return self._block.first_answer()

    def _block_frame(self, request: bytes) -> tuple[bytes, ...]:
        """One frame of a block transfer under way."""
        assert self._block is not None
        answers = self._block.answer(request)
        if self._block.finished:
            self._block = None
        return answers

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
            command = 0x43 | (4 - len(data)) << 2 if self._sized else 0x42
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
