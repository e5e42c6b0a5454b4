"""The object dictionary of one simulated drive: entries of ``drive.eds``, values, access (CiA 301)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import canopen
from canopen.objectdictionary import ODVariable

EDS_PATH = Path(__file__).parent / "drive.eds"

VISIBLE_STRING = 0x09
_INTEGERS = {0x02: "b", 0x03: "h", 0x04: "i", 0x05: "B", 0x06: "H", 0x07: "I"}


class SdoAbort(Exception):
    """A refused access; ``code`` is the abort code of CiA 301, table 22."""

    def __init__(self, code: int) -> None:
        self.code = code
        super().__init__(f"SDO abort 0x{code:08X}")


TOGGLE_BIT = 0x05030000
COMMAND_SPECIFIER = 0x05040001
BLOCK_SIZE = 0x05040002
BLOCK_SEQUENCE = 0x05040003
CRC_ERROR = 0x05040004
WRITE_ONLY = 0x06010001
READ_ONLY = 0x06010002
NO_OBJECT = 0x06020000
NOT_MAPPABLE = 0x06040041
MAPPING_TOO_LONG = 0x06040042
LENGTH_MISMATCH = 0x06070010
TOO_LONG = 0x06070012
TOO_SHORT = 0x06070013
NO_SUBINDEX = 0x06090011
VALUE_RANGE = 0x06090030
VALUE_TOO_HIGH = 0x06090031
VALUE_TOO_LOW = 0x06090032
NOT_STORED = 0x08000020
DEVICE_STATE = 0x08000022
NO_DATA = 0x08000024

_HISTORY = 0x1003
"""Its entries beyond its count hold no error."""

Key = tuple[int, int]


@dataclass(frozen=True)
class Entry:
    """One sub-object: its type, access rights, limits and value after a reset."""

    index: int
    subindex: int
    format: str
    """``struct`` format of an integer; empty for a string."""
    access: str
    default: int | bytes
    low: int | None
    high: int | None
    mappable: bool

    @property
    def writable(self) -> bool:
        """Whether a client may write it."""
        return self.access not in ("ro", "const")

    @property
    def bits(self) -> int:
        """Length of an integer in bits; 0 for a string."""
        return 8 * struct.calcsize("<" + self.format) if self.format else 0

    def encode(self, value: int | bytes) -> bytes:
        """The value as SDO and PDO carry it."""
        return value if isinstance(value, bytes) else struct.pack("<" + self.format, value)

    def decode(self, data: bytes) -> int | bytes:
        """A value from the wire.

        Raises:
            SdoAbort: wrong length, or outside the entry's limits.
        """
        if not self.format:
            return data
        size = self.bits // 8
        if len(data) != size:
            raise SdoAbort(TOO_LONG if len(data) > size else TOO_SHORT)
        value = int(struct.unpack("<" + self.format, data)[0])
        if self.high is not None and value > self.high:
            raise SdoAbort(VALUE_TOO_HIGH)
        if self.low is not None and value < self.low:
            raise SdoAbort(VALUE_TOO_LOW)
        return value


class ObjectDictionary:
    """Values of one node's objects, with the checks that an SDO server owes its client.

    Args:
        node_id: replaces $NODEID in the EDS.

    ``guards`` and ``listeners`` hold, by index, what is asked before a write through SDO (it may raise
    :class:`SdoAbort`) and told after one; both get sub-index and value.
    """

    def __init__(self, node_id: int) -> None:
        self.absent_code = 0
        """With what an access to an object that is not there is aborted; by the standard where 0."""
        self._entries = dict(_entries(node_id))
        self._indices = {index for index, _ in self._entries}
        self.values: dict[Key, int | bytes] = {key: entry.default for key, entry in self._entries.items()}
        self.guards: dict[int, Callable[[int, int | bytes], None]] = {}
        self.listeners: dict[int, Callable[[int, int | bytes], None]] = {}

    def add(self, entry: Entry) -> None:
        """Adds an object that the EDS does not have, such as a vendor's control signal."""
        self._entries[entry.index, entry.subindex] = entry
        self._indices.add(entry.index)
        self.values[entry.index, entry.subindex] = entry.default

    def remove(self, index: int) -> None:
        """Takes an object away with all its sub-indices: this device does not have it."""
        self._indices.discard(index)
        for key in [key for key in self._entries if key[0] == index]:
            del self._entries[key]

    def remove_entry(self, index: int, subindex: int) -> None:
        """Takes one sub-index away."""
        self._entries.pop((index, subindex), None)

    def entry(self, index: int, subindex: int) -> Entry:
        """The description of a sub-object.

        Raises:
            SdoAbort: there is none.
        """
        found = self._entries.get((index, subindex))
        if found is None:
            raise SdoAbort(self.absent_code or (NO_SUBINDEX if index in self._indices else NO_OBJECT))
        return found

    def has(self, index: int, subindex: int) -> bool:
        """Whether there is such a sub-object."""
        return (index, subindex) in self._entries

    def take(self, other: ObjectDictionary, indices: range) -> None:
        """Takes the values of some objects from another dictionary."""
        self.values.update({key: value for key, value in other.values.items() if key[0] in indices})

    def integer(self, index: int, subindex: int = 0) -> int:
        """The value of an integer object, for the drive itself."""
        value = self.values[index, subindex]
        if isinstance(value, bytes):
            raise TypeError(f"object 0x{index:04X}:{subindex} is a string")
        return value

    def set(self, index: int, subindex: int, value: int | bytes) -> None:
        """Sets a value from inside the drive, whatever its access rights."""
        self.values[index, subindex] = value

    def read(self, index: int, subindex: int) -> bytes:
        """SDO upload.

        Raises:
            SdoAbort: no such object, or write only.
        """
        entry = self.entry(index, subindex)
        if entry.access == "wo":
            raise SdoAbort(WRITE_ONLY)
        if index == _HISTORY and subindex > self.integer(_HISTORY):
            raise SdoAbort(NO_DATA)
        return entry.encode(self.values[index, subindex])

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """SDO download.

        Raises:
            SdoAbort: no such object, read only, wrong length, outside its limits, or refused in this state.
        """
        entry = self.entry(index, subindex)
        if entry.access in ("ro", "const"):
            raise SdoAbort(READ_ONLY)
        value = entry.decode(data)
        guard = self.guards.get(index)
        if guard is not None:
            guard(subindex, value)
        self.values[index, subindex] = value
        listener = self.listeners.get(index)
        if listener is not None:
            listener(subindex, value)


@lru_cache(maxsize=128)
def _entries(node_id: int) -> dict[Key, Entry]:
    dictionary = canopen.import_od(str(EDS_PATH), node_id)
    found: dict[Key, Entry] = {}
    for thing in dictionary.values():
        variables = [thing] if isinstance(thing, ODVariable) else list(thing.values())
        for variable in variables:
            found[variable.index, variable.subindex] = _entry(variable)
    return found


def _entry(variable: ODVariable) -> Entry:
    kind = variable.data_type or 0
    text = kind == VISIBLE_STRING
    default = variable.default
    return Entry(
        index=variable.index,
        subindex=variable.subindex,
        format="" if text else _INTEGERS[kind],
        access=variable.access_type,
        default=str(default or "").encode("ascii") if text else int(default or 0),
        low=variable.min,
        high=variable.max,
        mappable=bool(variable.pdo_mappable),
    )
