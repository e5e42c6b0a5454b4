"""Common Data Representation (OMG CDR, the plain XCDR1 form that ROS 2 uses): encode and decode.

A message starts with four bytes that name the byte order; every primitive is then aligned to its own
size, counted from the end of those four bytes. A sequence is a uint32 length and its elements; a
string is a sequence of bytes with a closing zero that counts.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

LITTLE_ENDIAN = b"\x00\x01\x00\x00"
HEADER_SIZE = 4

SIZES = {
    "bool": 1,
    "uint8": 1,
    "uint16": 2,
    "int32": 4,
    "uint32": 4,
    "uint64": 8,
    "float64": 8,
}
_CODES = {
    "bool": "?",
    "uint8": "B",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "uint64": "Q",
    "float64": "d",
}


class CdrError(ValueError):
    """Bytes that are not the message they are said to be."""


class CdrEncoder:
    """Appends values to one little-endian message; ``offset`` is where the last value began."""

    def __init__(self) -> None:
        self._data = bytearray(LITTLE_ENDIAN)
        self.offset = HEADER_SIZE

    def _align(self, size: int) -> None:
        self._data.extend(bytes(-(len(self._data) - HEADER_SIZE) % size))

    def primitive(self, kind: str, value: float | bool) -> None:
        """Append one value of a primitive type named as in a .msg file."""
        self._align(SIZES[kind])
        self.offset = len(self._data)
        self._data += struct.pack("<" + _CODES[kind], value)

    def string(self, value: str) -> None:
        """Append one UTF-8 string."""
        text = value.encode() + b"\x00"
        self.primitive("uint32", len(text))
        self._data += text

    def strings(self, values: Sequence[str]) -> None:
        """Append a sequence of strings."""
        self.primitive("uint32", len(values))
        for value in values:
            self.string(value)

    def sequence(self, kind: str, values: Sequence[float] | Sequence[bool]) -> None:
        """Append a sequence of primitives; ``offset`` is where its first element began."""
        self.primitive("uint32", len(values))
        if len(values):
            self._align(SIZES[kind])
        self.offset = len(self._data)
        self._data += struct.pack(f"<{len(values)}{_CODES[kind]}", *values)

    def finish(self) -> bytes:
        """The message so far."""
        return bytes(self._data)


class CdrDecoder:
    """Reads values off one message of either byte order, in the order they were written."""

    def __init__(self, data: bytes) -> None:
        if len(data) < HEADER_SIZE or data[0] != 0 or data[1] not in (0, 1):
            raise CdrError("not a plain CDR message: its first two bytes must be 00 00 or 00 01")
        self._data = data
        self._order = "<" if data[1] == 1 else ">"
        self._at = HEADER_SIZE

    def _take(self, form: str, size: int, alignment: int) -> tuple[float, ...]:
        if size:
            self._at += -(self._at - HEADER_SIZE) % alignment
        if self._at + size > len(self._data):
            raise CdrError(f"message ends at byte {len(self._data)} inside a value of {size} bytes")
        values = struct.unpack_from(self._order + form, self._data, self._at)
        self._at += size
        return values

    def primitive(self, kind: str) -> float:
        """Read one value of a primitive type named as in a .msg file."""
        return self._take(_CODES[kind], SIZES[kind], SIZES[kind])[0]

    def string(self) -> str:
        """Read one UTF-8 string."""
        length = int(self.primitive("uint32"))
        if self._at + length > len(self._data):
            raise CdrError(f"message ends at byte {len(self._data)} inside a string of {length} bytes")
        text = self._data[self._at : self._at + length]
        self._at += length
        try:
            return text.removesuffix(b"\x00").decode()
        except UnicodeDecodeError as error:
            raise CdrError("a string is not UTF-8") from error

    def strings(self) -> list[str]:
        """Read a sequence of strings."""
        count = int(self.primitive("uint32"))
        if count * 4 > len(self._data):
            raise CdrError(f"{count} strings cannot be in a message of {len(self._data)} bytes")
        return [self.string() for _ in range(count)]

    def sequence(self, kind: str) -> list[float]:
        """Read a sequence of primitives."""
        count = int(self.primitive("uint32"))
        size = count * SIZES[kind]
        if size > len(self._data):
            raise CdrError(f"{count} values of {kind} cannot be in a message of {len(self._data)} bytes")
        return list(self._take(f"{count}{_CODES[kind]}", size, SIZES[kind]))
