"""Walk the records of an MCAP file that may be damaged, and hand out only what is proven intact.

A stock reader stops at the first bad record. This one checks each chunk against its CRC, each metadata
record by its own shape, and after a bad one looks for the next place where a whole record begins.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, Metadata
from numpy.typing import NDArray

from daq.recording.mcap_file import MAGIC, MESSAGE_HEAD, Rows, message_dtype

_RECORD_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
# A chunk names its compression 28 bytes into its body; a metadata record of ours begins with its name.
_CHUNK_MARK = struct.pack("<I", 4) + b"zstd"
_CHUNK_MARK_AT = _RECORD_HEAD.size + _CHUNK_HEAD.size
_METADATA_MARK = b"armhil."
_METADATA_MARK_AT = _RECORD_HEAD.size + 4
_LARGEST_CHUNK = 64 * 1024 * 1024
_SAME_HEAD = _RECORD_HEAD.size + 2
"""Opcode, length and channel: messages that agree in them lie evenly spaced."""

Wanted = Callable[[int], bool]


@dataclass(frozen=True)
class MessageRun:
    """Messages of one channel and one length that follow each other in a chunk."""

    channel: int
    sequence: NDArray[np.uint32]
    log_time: NDArray[np.int64]
    rows: Rows
    """N × size."""

    def copy(self) -> MessageRun:
        """The same without the chunk, which a view of it would keep."""
        return MessageRun(self.channel, self.sequence.copy(), self.log_time, self.rows.copy())


@dataclass
class Scan:
    """What a file holds, in file order."""

    profile: str = ""
    channels: dict[int, str] = field(default_factory=dict)
    runs: dict[int, list[MessageRun]] = field(default_factory=dict)
    metadata: list[Metadata] = field(default_factory=list)
    unreadable_bytes: int = 0
    ended: bool = False
    """Whether the record that ends the data was found."""
    counts: dict[int, int] = field(default_factory=dict)
    """Messages by channel, those of channels that were not wanted too."""
    last: dict[int, int] = field(default_factory=dict)
    """Largest sequence number by channel."""


def scan(data: bytes, wanted: Wanted = lambda channel: True) -> Scan:
    """Read every intact record of ``data``, which begins with the MCAP magic.

    Args:
        data: the whole file.
        wanted: which channels' messages to keep; all chunks are checked in any case.
    """
    result = Scan()
    for _ in chunks(data, result, wanted):
        pass
    return result


def chunks(data: bytes, result: Scan, wanted: Wanted = lambda channel: True) -> Iterator[Scan]:
    """The same walk, step by step, for files that are larger than memory: ``result`` may be emptied of its
    runs and metadata between two steps."""
    at = len(MAGIC)
    # What follows the end of data repeats it in summary; a file cut off there has lost nothing.
    while at < len(data) and not result.ended:
        end = _read_record(data, at, result, wanted)
        if end is None:
            following = _next_record(data, at + 1)
            result.unreadable_bytes += following - at
            at = following
        else:
            at = end
        yield result


def _read_record(data: bytes, at: int, result: Scan, wanted: Wanted) -> int | None:
    """Read the record at ``at`` into ``result``; where it ends, or None where it is not intact."""
    if at + _RECORD_HEAD.size > len(data):
        return None
    opcode, length = _RECORD_HEAD.unpack_from(data, at)
    begin = at + _RECORD_HEAD.size
    end: int = begin + length
    if end > len(data):
        return None
    try:
        _read_body(opcode, data[begin:end], result, wanted)
    except (McapError, ValueError, OverflowError, MemoryError, struct.error, zstandard.ZstdError):
        return None  # lengths of what was spliced in may be any number of 64 bits
    return end


def _read_body(opcode: int, body: bytes, result: Scan, wanted: Wanted) -> None:
    """Read one record. A body that is not used to its last byte has a false length."""
    stream = ReadDataStream(BytesIO(body))
    if opcode == Opcode.CHUNK:
        chunk = Chunk.read(stream)
        _check_used(stream, body)
        _read_chunk(chunk, result, wanted)
    elif opcode == Opcode.METADATA:
        metadata = Metadata.read(stream)
        _check_used(stream, body)
        result.metadata.append(metadata)
    elif opcode == Opcode.HEADER:
        result.profile = Header.read(stream).profile
        _check_used(stream, body)
    elif opcode == Opcode.MESSAGE_INDEX:
        _, length = struct.unpack_from("<HI", body)
        if length + 6 != len(body):
            raise ValueError("a false length")
    elif opcode == Opcode.DATA_END and len(body) == 4:
        result.ended = True
    else:
        raise ValueError("a record that captures do not have")


def _check_used(stream: ReadDataStream, body: bytes) -> None:
    if stream.count != len(body):
        raise ValueError("a false length")


def _read_chunk(chunk: Chunk, result: Scan, wanted: Wanted) -> None:
    if chunk.compression != "zstd":
        raise ValueError("a compression that captures do not have")
    sizes = (zstandard.frame_content_size(chunk.data), chunk.uncompressed_size)
    if not all(0 <= size <= _LARGEST_CHUNK for size in sizes):
        raise ValueError("a chunk of implausible size")
    if chunk.uncompressed_crc == 0:
        raise ValueError("a chunk without a checksum cannot be trusted")
    records = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=_LARGEST_CHUNK)
    if len(records) != chunk.uncompressed_size or zlib.crc32(records) != chunk.uncompressed_crc:
        raise ValueError("a chunk whose checksum is wrong")
    _read_records(records, result, wanted)


def _read_records(records: bytes, result: Scan, wanted: Wanted) -> None:
    """The records inside a chunk: messages by the run."""
    at = 0
    while at < len(records):
        opcode, length = _RECORD_HEAD.unpack_from(records, at)
        end = at + _RECORD_HEAD.size + length
        if end > len(records):
            raise ValueError("a record that is cut off")
        if opcode == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(BytesIO(records[at + _RECORD_HEAD.size : end])))
            result.channels[channel.id] = channel.topic
        elif opcode == Opcode.MESSAGE:
            run, end = _message_run(records, at, length)
            result.counts[run.channel] = result.counts.get(run.channel, 0) + len(run.sequence)
            result.last[run.channel] = max(result.last.get(run.channel, 0), int(run.sequence.max()))
            if wanted(run.channel):
                result.runs.setdefault(run.channel, []).append(run.copy())
        at = end


def _message_run(records: bytes, at: int, length: int) -> tuple[MessageRun, int]:
    """The messages that follow each other with the same length and channel, and where they end."""
    if length < MESSAGE_HEAD:
        raise ValueError("a message without its head")
    stride = _RECORD_HEAD.size + length
    count = _same_heads(records, at, stride)
    found = np.frombuffer(records, message_dtype(length - MESSAGE_HEAD), count, at)
    run = MessageRun(
        channel=int(found["channel"][0]),
        sequence=found["sequence"],
        log_time=found["log_time"].astype(np.int64),
        rows=found["data"],
    )
    return run, at + count * stride


def _same_heads(records: bytes, at: int, stride: int) -> int:
    """How many rows of ``stride`` bytes begin as the one at ``at`` does."""
    most = (len(records) - at) // stride
    table = np.frombuffer(records, np.uint8, most * stride, at).reshape(most, stride)[:, :_SAME_HEAD]
    done, window = 1, 8
    while done < most:
        same = (table[done : done + window] == table[0]).all(axis=1)
        if not same.all():
            return done + int(np.argmin(same))
        done += len(same)
        window *= 4
    return done


def _next_record(data: bytes, start: int) -> int:
    """Where the next plausible chunk or metadata record begins at or after ``start``; else the end."""
    candidates = (
        _find_mark(data, start, _CHUNK_MARK, _CHUNK_MARK_AT, Opcode.CHUNK),
        _find_mark(data, start, _METADATA_MARK, _METADATA_MARK_AT, Opcode.METADATA),
    )
    return min(candidates)


def _find_mark(data: bytes, start: int, mark: bytes, mark_at: int, opcode: int) -> int:
    at = data.find(mark, start + mark_at)
    while at >= 0:
        record = at - mark_at
        found, length = _RECORD_HEAD.unpack_from(data, record)
        if found == opcode and record + _RECORD_HEAD.size + length <= len(data):
            return record
        at = data.find(mark, at + 1)
    return len(data)
