"""Walk the records of an MCAP file that may be damaged, and hand out only what is proven intact.

A stock reader stops at the first bad record. This one checks each chunk against its CRC, each metadata
record by its own shape, and after a bad one looks for the next place where a whole record begins.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from io import BytesIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, Message, Metadata
from mcap.stream_reader import breakup_chunk

MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
# A chunk names its compression 28 bytes into its body; a metadata record of ours begins with its name.
_CHUNK_MARK = struct.pack("<I", 4) + b"zstd"
_CHUNK_MARK_AT = _RECORD_HEAD.size + _CHUNK_HEAD.size
_METADATA_MARK = b"armhil."
_METADATA_MARK_AT = _RECORD_HEAD.size + 4
_LARGEST_CHUNK = 64 * 1024 * 1024


@dataclass
class Scan:
    """What a file holds, in file order."""

    profile: str = ""
    channels: dict[int, str] = field(default_factory=dict)
    messages: dict[int, list[Message]] = field(default_factory=dict)
    metadata: list[Metadata] = field(default_factory=list)
    unreadable_bytes: int = 0
    ended: bool = False
    """Whether the record that ends the data was found."""


def scan(data: bytes) -> Scan:
    """Read every intact record of ``data``, which begins with the MCAP magic."""
    result = Scan()
    at = len(MAGIC)
    # What follows the end of data repeats it in summary; a file cut off there has lost nothing.
    while at < len(data) and not result.ended:
        end = _read_record(data, at, result)
        if end is None:
            following = _next_record(data, at + 1)
            result.unreadable_bytes += following - at
            at = following
        else:
            at = end
    return result


def _read_record(data: bytes, at: int, result: Scan) -> int | None:
    """Read the record at ``at`` into ``result``; where it ends, or None where it is not intact."""
    if at + _RECORD_HEAD.size > len(data):
        return None
    opcode, length = _RECORD_HEAD.unpack_from(data, at)
    begin = at + _RECORD_HEAD.size
    end: int = begin + length
    if end > len(data):
        return None
    try:
        _read_body(opcode, data[begin:end], result)
    except (McapError, ValueError, struct.error, zstandard.ZstdError, RuntimeError):
        return None
    return end


def _read_body(opcode: int, body: bytes, result: Scan) -> None:
    """Read one record. A body that is not used to its last byte has a false length."""
    stream = ReadDataStream(BytesIO(body))
    if opcode == Opcode.CHUNK:
        chunk = Chunk.read(stream)
        _check_used(stream, body)
        _read_chunk(chunk, result)
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


def _read_chunk(chunk: Chunk, result: Scan) -> None:
    if chunk.compression != "zstd":
        raise ValueError("a compression that captures do not have")
    sizes = (zstandard.frame_content_size(chunk.data), chunk.uncompressed_size)
    if not all(0 <= size <= _LARGEST_CHUNK for size in sizes):
        raise ValueError("a chunk of implausible size")
    if chunk.uncompressed_crc == 0:
        raise ValueError("a chunk without a checksum cannot be trusted")
    for record in breakup_chunk(chunk, validate_crc=True):
        if isinstance(record, Channel):
            result.channels[record.id] = record.topic
        elif isinstance(record, Message):
            result.messages.setdefault(record.channel_id, []).append(record)


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
