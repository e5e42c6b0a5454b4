"""Write MCAP in batches: many messages of one length become one array, not one object each.

The mcap library's writer costs some 5 µs a message. With raw frames a capture takes 16 messages per cycle, at
1 kHz, so here the records of a batch are laid out by NumPy. What is written is what the specification
(mcap.dev/spec) asks for: chunks with checksum, message indexes, summary; the library's own reader opens it.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

MAGIC = b"\x89MCAP0\r\n"
MESSAGE_HEAD = 22
"""Bytes of a message record between its length and its data."""
_FIRST_ROOM = 1 << 18
"""Bytes; a chunk of 0.1 s at 1 kHz with six axes and raw frames takes half of that."""
COMPRESSION_LEVEL = 1
"""Of zstd: 3, the usual one, makes files a tenth smaller for twice the time."""

_CHUNK_HEAD = struct.Struct("<BQQQQI")
_HEAD_BYTES = _CHUNK_HEAD.size + 4 + len(b"zstd") + 8
"""Of a chunk before its compressed records."""
_RECORD_HEAD = struct.Struct("<BQ")
_INDEX_HEAD = struct.Struct("<BQHI")
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])

Rows = NDArray[np.uint8]


@dataclass(frozen=True)
class Topic:
    """One channel: what it is called and what its messages are."""

    name: str
    schema: str
    definition: str


@cache
def message_dtype(size: int) -> np.dtype[np.void]:
    """A message record with so many bytes of data, as one packed row."""
    return np.dtype(
        [
            ("opcode", "u1"),
            ("length", "<u8"),
            ("channel", "<u2"),
            ("sequence", "<u4"),
            ("log_time", "<u8"),
            ("publish_time", "<u8"),
            ("data", "u1", (size,)),
        ]
    )


class McapFile:
    """An MCAP file that grows by batches. Channels are numbered from 1 in the order of ``topics``.

    Args:
        file: empty, a file of the system opened for writing and reading in binary mode; used, not closed.
        profile, library: of the file's header.
        topics: all channels; written into the first chunk.
    """

    def __init__(self, file: BinaryIO, profile: str, library: str, topics: Sequence[Topic]) -> None:
        self._file = file
        self._compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
        self._at = 0
        self._schemas, self._channels = _definitions(topics)
        self._records = np.empty(_FIRST_ROOM, dtype=np.uint8)
        """Of the open chunk, in its first ``_size`` bytes: one buffer for all chunks, so that a long run does
        not leave memory in pieces."""
        self._size = 0
        self._indexes: dict[int, list[NDArray[np.void]]] = {}
        self._times = (2**64 - 1, 0)
        self._metadata_indexes: list[MetadataIndex] = []
        self._counts = dict.fromkeys(self._channels, 0)
        self._chunks = 0
        self._span = (2**64 - 1, 0)
        self._write(MAGIC)
        self._write(_packed(Header(profile, library)))
        for record in (*self._schemas.values(), *self._channels.values()):
            self._append(_packed(record))

    def add(self, channel: int, sequences: NDArray[np.uint32], stamps: NDArray[np.int64], rows: Rows) -> None:
        """Append N messages of one length to the open chunk.

        Args:
            channel: number of the channel.
            sequences, stamps: (N,) sequence numbers, and times in ns since the epoch.
            rows: N × size, the messages.
        """
        count, size = rows.shape
        if not count:
            return
        form = message_dtype(size)
        records = self._room(count * form.itemsize).view(form)
        records["opcode"] = Opcode.MESSAGE
        records["length"] = MESSAGE_HEAD + size
        records["channel"] = channel
        records["sequence"] = sequences
        records["log_time"] = records["publish_time"] = stamps
        records["data"] = rows
        index = np.empty(count, dtype=_INDEX_ENTRY)
        index["time"] = stamps
        begin = self._size - records.nbytes
        index["offset"] = begin + np.arange(count, dtype=np.uint64) * np.uint64(records.itemsize)
        self._indexes.setdefault(channel, []).append(index)
        self._times = (min(self._times[0], int(stamps.min())), max(self._times[1], int(stamps.max())))
        self._counts[channel] += count

    def add_metadata(self, name: str, record: dict[str, str]) -> None:
        """Append a metadata record; what was added before it is in the file before it."""
        self._close_chunk()
        begin = self._at
        self._write(_packed(Metadata(name=name, metadata=record)))
        self._metadata_indexes.append(MetadataIndex(offset=begin, length=self._at - begin, name=name))

    def flush(self) -> None:
        """Close the open chunk and hand everything to the operating system."""
        self._close_chunk()
        self._file.flush()

    def finish(self) -> None:
        """Write the end of the data and the summary.

        What the summary says of the chunks is read back from the file: an hour has 36 000 of them, and a
        recorder's memory must not grow with the run.
        """
        self._close_chunk()
        end = self._at
        self._write(_packed(DataEnd(0)))
        self._file.flush()
        self._write_summary(chunk_indexes(self._file.fileno(), end))
        self._file.flush()

    def _append(self, piece: bytes) -> None:
        self._room(len(piece))[:] = np.frombuffer(piece, dtype=np.uint8)

    def _room(self, size: int) -> NDArray[np.uint8]:
        """So many bytes more of the open chunk, to be filled; valid until the next call."""
        begin, self._size = self._size, self._size + size
        if self._size > len(self._records):
            grown = np.empty(2 * self._size, dtype=np.uint8)
            grown[:begin] = self._records[:begin]
            self._records = grown
        return self._records[begin : self._size]

    def _write(self, data: bytes) -> None:
        self._file.write(data)
        self._at += len(data)

    def _close_chunk(self) -> None:
        if not self._size:
            return
        records = memoryview(self._records)[: self._size]  # type: ignore[arg-type]
        data = self._compressor.compress(records)
        first, last = self._times if self._indexes else (0, 0)
        length = 8 + 8 + 8 + 4 + 4 + len(b"zstd") + 8 + len(data)
        head = _CHUNK_HEAD.pack(Opcode.CHUNK, length, first, last, len(records), zlib.crc32(records))
        self._write(head + struct.pack("<I4sQ", 4, b"zstd", len(data)) + data)
        for channel, parts in self._indexes.items():
            entries = b"".join(part.tobytes() for part in parts)
            self._write(
                _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + len(entries), channel, len(entries)) + entries
            )
        self._chunks += 1
        if self._indexes:
            self._span = (min(self._span[0], first), max(self._span[1], last))
        self._size, self._indexes = 0, {}
        self._times = (2**64 - 1, 0)

    def _write_summary(self, chunks: Iterable[bytes]) -> None:
        total = sum(self._counts.values())
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=self._chunks,
            message_count=total,
            message_end_time=self._span[1] if total else 0,
            message_start_time=self._span[0] if total else 0,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )
        groups = (
            (Opcode.SCHEMA, map(_packed, self._schemas.values())),
            (Opcode.CHANNEL, map(_packed, self._channels.values())),
            (Opcode.STATISTICS, [_packed(statistics)]),
            (Opcode.CHUNK_INDEX, chunks),
            (Opcode.METADATA_INDEX, map(_packed, self._metadata_indexes)),
        )
        begin, offsets, crc = self._at, b"", 0
        for opcode, records in groups:
            start = self._at
            for record in records:
                crc = zlib.crc32(record, crc)
                self._write(record)
            if self._at > start:
                offsets += _packed(SummaryOffset(opcode, start, self._at - start))
        end = self._at
        footer_head = struct.pack("<BQQQ", Opcode.FOOTER, 20, begin, end)
        crc = zlib.crc32(footer_head, zlib.crc32(offsets, crc))
        self._write(offsets + _packed(Footer(begin, end, crc)) + MAGIC)


def chunk_indexes(descriptor: int, end: int) -> Iterator[bytes]:
    """The index record of every chunk of a file that :class:`McapFile` has written.

    Args:
        descriptor: of the file; only read, at no cost to where it is written.
        end: offset behind the last chunk.
    """
    at = len(MAGIC)
    while at < end:
        head = os.pread(descriptor, _HEAD_BYTES, at)
        opcode, length = _RECORD_HEAD.unpack_from(head)
        after = at + _RECORD_HEAD.size + length
        if opcode != Opcode.CHUNK:
            at = after
            continue
        _, _, first, last, uncompressed, _ = _CHUNK_HEAD.unpack_from(head)
        chunk_end, offsets = after, {}
        while after < end:
            index = os.pread(descriptor, _INDEX_HEAD.size, after)
            opcode, length, channel, _ = _INDEX_HEAD.unpack(index)
            if opcode != Opcode.MESSAGE_INDEX:
                break
            offsets[channel] = after
            after += _RECORD_HEAD.size + length
        yield _packed(
            ChunkIndex(
                chunk_length=chunk_end - at,
                chunk_start_offset=at,
                compression="zstd",
                compressed_size=chunk_end - at - _HEAD_BYTES,
                message_end_time=last,
                message_index_length=after - chunk_end,
                message_index_offsets=offsets,
                message_start_time=first,
                uncompressed_size=uncompressed,
            )
        )
        at = after


def _definitions(topics: Sequence[Topic]) -> tuple[dict[str, Schema], dict[int, Channel]]:
    schemas: dict[str, Schema] = {}
    channels: dict[int, Channel] = {}
    for number, topic in enumerate(topics, start=1):
        if topic.schema not in schemas:
            schemas[topic.schema] = Schema(
                id=len(schemas) + 1, data=topic.definition.encode(), encoding="ros2msg", name=topic.schema
            )
        channels[number] = Channel(
            id=number,
            topic=topic.name,
            message_encoding="cdr",
            metadata={},
            schema_id=schemas[topic.schema].id,
        )
    return schemas, channels


def _packed(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())
