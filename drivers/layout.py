"""What the process data objects carry, byte by byte, as precompiled layouts."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.cia402 import objects
from drivers.errors import DriveError

PDO_BITS = 64
SIGNED_FORMATS = {8: "b", 16: "h", 32: "i"}

SYNC_COB_ID = 0x080
NMT_COB_ID = 0x000


def emcy_cob_id(node: int) -> int:
    return 0x080 + node


def tpdo_cob_id(node: int) -> int:
    return 0x180 + node


def rpdo_cob_id(node: int) -> int:
    return 0x200 + node


def sdo_answer_cob_id(node: int) -> int:
    return 0x580 + node


def sdo_request_cob_id(node: int) -> int:
    return 0x600 + node


def heartbeat_cob_id(node: int) -> int:
    return 0x700 + node


def master_cob_ids(nodes: tuple[int, ...]) -> frozenset[int]:
    """COB-IDs that only a master of these nodes sends."""
    own = {rpdo_cob_id(node) for node in nodes} | {sdo_request_cob_id(node) for node in nodes}
    return frozenset(own | {SYNC_COB_ID, NMT_COB_ID})


@dataclass(frozen=True)
class MappedObject:
    """One entry of a PDO mapping."""

    index: int
    subindex: int
    bits: int

    @property
    def word(self) -> int:
        """The entry as the mapping object holds it: index, subindex, length (CiA 301, 7.5.2.36)."""
        return self.index << 16 | self.subindex << 8 | self.bits

    def __str__(self) -> str:
        return f"{self.index:04X}:{self.subindex:02X}"


CONTROLWORD = MappedObject(objects.CONTROLWORD, 0, 16)
TARGET_POSITION = MappedObject(objects.TARGET_POSITION, 0, 32)
STATUSWORD = MappedObject(objects.STATUSWORD, 0, 16)
ACTUAL_POSITION = MappedObject(objects.ACTUAL_POSITION, 0, 32)

RPDO_OBJECTS = (CONTROLWORD, TARGET_POSITION)
RPDO = struct.Struct("<Hi")
"""Controlword, target position."""


def tpdo_objects(control_signal: MappedObject) -> tuple[MappedObject, ...]:
    """Statusword, actual position and control signal: one snapshot of one SYNC.

    Raises:
        DriveError: the control-signal object has no width that fits into the eight bytes.
    """
    entries = (STATUSWORD, ACTUAL_POSITION, control_signal)
    free = PDO_BITS - STATUSWORD.bits - ACTUAL_POSITION.bits
    if control_signal.bits not in SIGNED_FORMATS or control_signal.bits > free:
        raise DriveError(
            f"control-signal object {control_signal} has {control_signal.bits} bits; "
            f"allowed: 8 or {free}, so that one TPDO carries it with statusword and position"
        )
    return entries


def tpdo_layout(control_signal_bits: int) -> struct.Struct:
    """Statusword, actual position, control signal."""
    return struct.Struct("<Hi" + SIGNED_FORMATS[control_signal_bits])
