"""One PDO of a simulated drive: communication and mapping parameters, their rules, and the packing."""

from __future__ import annotations

import struct
from collections.abc import Callable

from drivers.simulated.object_dictionary import (
    DEVICE_STATE,
    MAPPING_TOO_LONG,
    NOT_MAPPABLE,
    READ_ONLY,
    VALUE_RANGE,
    Key,
    ObjectDictionary,
    SdoAbort,
)
from drivers.simulated.quirks import STANDARD, Quirks

_INVALID = 1 << 31
_EXTENDED = 1 << 29
_MAX_BITS = 64
_RESTRICTED = (
    range(0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x800),
)
"""COB-IDs that no configurable object may have (CiA 301, 7.3.5)."""
_SYNCHRONOUS = range(241)
_REMOTE_ONLY, _EVENT_DRIVEN = range(252, 254), range(254, 256)
_NO_REMOTE_FRAMES = 1 << 30
_DUMMIES = {2: 8, 3: 16, 4: 32, 5: 8, 6: 16, 7: 32}
"""Bits of data types that an RPDO may map to nothing (CiA 301, 7.5.1.3; DummyUsage of the EDS)."""


class Pdo:
    """A PDO that is what its objects say (CiA 301, 7.5.2.35 to 7.5.2.38).

    Its mapping can be written only while the PDO is marked invalid and sub-index 0 is zero, and nothing of it
    while ``locked()`` says that the drive has torque.

    Args:
        dictionary: where communication and mapping parameters live.
        communication: index of the communication parameters, 0x1400 or 0x1800.
        mapping: index of the mapping parameters, 0x1600 or 0x1A00.
        received: True for an RPDO, whose objects must be writable.
        locked: whether the parameters are fixed at the moment.
        quirks: what this kind of drive does otherwise.
    """

    def __init__(
        self,
        dictionary: ObjectDictionary,
        communication: int,
        mapping: int,
        received: bool,
        locked: Callable[[], bool],
        quirks: Quirks = STANDARD,
    ) -> None:
        self._quirks = quirks
        self._dictionary = dictionary
        self._communication = communication
        self._mapping = mapping
        self._received = received
        self._locked = locked
        dictionary.guards[communication] = self._guard_communication
        dictionary.guards[mapping] = self._guard_mapping
        dictionary.listeners[communication] = self._changed
        dictionary.listeners[mapping] = self._changed
        self.cob_id = 0
        self.valid = False
        self.remote_allowed = False
        self.transmission_type = 1
        self._layout = struct.Struct("<")
        self._keys: tuple[Key, ...] = ()
        self._changed(0, 0)

    @property
    def synchronous(self) -> bool:
        """Whether the PDO belongs to the SYNC."""
        return self.transmission_type in _SYNCHRONOUS

    @property
    def event_driven(self) -> bool:
        """Whether the PDO goes out when something has changed, or its event timer is over."""
        return self.valid and self.transmission_type in _EVENT_DRIVEN

    def milliseconds(self, subindex: int) -> float:
        """An inhibit time (3, units of 0.1 ms) or an event timer (5), s; 0 where there is none."""
        if not self._dictionary.has(self._communication, subindex):
            return 0.0
        return self._dictionary.integer(self._communication, subindex) * (1e-4 if subindex == 3 else 1e-3)

    def pack(self) -> bytes:
        """The mapped objects as a frame carries them."""
        values = self._dictionary.values
        return self._layout.pack(*[values[key] for key in self._keys])

    def unpack(self, data: bytes) -> bool:
        """Writes a received frame into the mapped objects; False, nothing written, where it is too short."""
        if len(data) < self._layout.size:
            return False
        self._dictionary.values.update(zip(self._keys, self._layout.unpack_from(data), strict=True))
        return True

    def maps(self, index: int) -> bool:
        """Whether an object is in the mapping."""
        return any(key[0] == index for key in self._keys)

    def _changed(self, subindex: int, value: int | bytes) -> None:
        dictionary = self._dictionary
        word = dictionary.integer(self._communication, 1)
        self.cob_id, self.valid = word & 0x7FF, not word & _INVALID
        self.remote_allowed = not word & _NO_REMOTE_FRAMES
        self.transmission_type = dictionary.integer(self._communication, 2)
        words = [
            dictionary.integer(self._mapping, k + 1) for k in range(dictionary.integer(self._mapping, 0))
        ]
        keys = [(word >> 16, word >> 8 & 0xFF) for word in words]
        formats = [
            f"{_DUMMIES[index] // 8}x" if index in _DUMMIES else dictionary.entry(index, subindex).format
            for index, subindex in keys
        ]
        self._keys = tuple(key for key in keys if key[0] not in _DUMMIES)
        self._layout = struct.Struct("<" + "".join(formats))

    def _guard_communication(self, subindex: int, value: int | bytes) -> None:
        assert isinstance(value, int)
        if self._locked():
            raise SdoAbort(DEVICE_STATE)
        if subindex == 1:
            if self._quirks.fixed_cob_ids:
                raise SdoAbort(READ_ONLY)
            if value & _EXTENDED or any(value & 0x7FF in ids for ids in _RESTRICTED):
                raise SdoAbort(VALUE_RANGE)
            if self.valid and not value & _INVALID and value & 0x7FF != self.cob_id:
                raise SdoAbort(DEVICE_STATE)
        elif subindex == 2:
            remote = not self._received and value in _REMOTE_ONLY
            types = self._quirks.rpdo_types if self._received else ()
            known = value in _SYNCHRONOUS or value in _EVENT_DRIVEN or remote
            if (types and value not in types) or not known:
                raise SdoAbort(VALUE_RANGE)
        elif subindex == 3 and self.valid:
            raise SdoAbort(DEVICE_STATE)  # the inhibit time of a PDO that exists (CiA 301, 7.5.2.37)

    def _guard_mapping(self, subindex: int, value: int | bytes) -> None:
        assert isinstance(value, int)
        if self._quirks.fixed_mapping:
            raise SdoAbort(READ_ONLY)
        count = self._dictionary.integer(self._mapping, 0)
        # Where nobody can switch a PDO off, it is mapped while it is on.
        live = self.valid and not self._quirks.fixed_cob_ids
        if self._locked() or live or (subindex > 0 and count > 0):
            raise SdoAbort(DEVICE_STATE)
        if subindex > 0:
            self._check_mapped(value)
            return
        words = [self._dictionary.integer(self._mapping, k + 1) for k in range(value)]
        for word in words:
            self._check_mapped(word)
        if sum(word & 0xFF for word in words) > _MAX_BITS:
            raise SdoAbort(MAPPING_TOO_LONG)

    def _check_mapped(self, word: int) -> None:
        if self._received and _DUMMIES.get(word >> 16) == word & 0xFFFF:
            return
        entry = self._dictionary.entry(word >> 16, word >> 8 & 0xFF)
        if not entry.mappable or entry.bits == 0 or entry.bits != word & 0xFF:
            raise SdoAbort(NOT_MAPPABLE)
        if self._received and entry.access in ("ro", "const"):
            raise SdoAbort(READ_ONLY)
