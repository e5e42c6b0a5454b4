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


def second_tpdo_cob_id(node: int) -> int:
    return 0x280 + node


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
INTERPOLATION_DATA = MappedObject(objects.INTERPOLATION_DATA, 1, 32)
STATUSWORD = MappedObject(objects.STATUSWORD, 0, 16)
ACTUAL_POSITION = MappedObject(objects.ACTUAL_POSITION, 0, 32)

RPDO = struct.Struct("<Hi")
"""Controlword, target position (or interpolation data)."""


@dataclass(frozen=True)
class DriveLink:
    """How one drive is spoken to in the cycle.

    Attributes:
        node: node id.
        name: how messages name the drive.
        control_signal_bits: width of the control signal; above 16 it has a second TPDO.
        interpolated: whether the drive runs in interpolated position mode (ip) and not in csp.
        heartbeat: s between the drive's heartbeats (1017h); 0 where it sends none.
        watches: whether the drive's heartbeat consumer (1016h) is set to this master.
    """

    node: int
    name: str
    control_signal_bits: int = 16
    interpolated: bool = False
    heartbeat: float = 0.0
    watches: bool = False


def rpdo_objects(interpolated: bool) -> tuple[MappedObject, ...]:
    """Controlword and set-point: 607Ah in csp, 60C1h:01 in interpolated position mode."""
    return CONTROLWORD, INTERPOLATION_DATA if interpolated else TARGET_POSITION


def tpdo_objects(control_signal: MappedObject) -> tuple[tuple[MappedObject, ...], ...]:
    """What the drive's TPDOs carry: one where all fits into its eight bytes, else two of the same SYNC.

    Raises:
        DriveError: the control-signal object is no integer of 8, 16 or 32 bits.
    """
    if control_signal.bits not in SIGNED_FORMATS:
        allowed = ", ".join(str(bits) for bits in SIGNED_FORMATS)
        raise DriveError(
            f"control-signal object {control_signal} has {control_signal.bits} bits; allowed: {allowed}"
        )
    if control_signal.bits <= PDO_BITS - STATUSWORD.bits - ACTUAL_POSITION.bits:
        return ((STATUSWORD, ACTUAL_POSITION, control_signal),)
    return (STATUSWORD, ACTUAL_POSITION), (control_signal,)


def tpdo_layouts(control_signal_bits: int) -> tuple[struct.Struct, ...]:
    """One layout per TPDO: statusword and actual position, and the control signal with them or alone."""
    signal = SIGNED_FORMATS[control_signal_bits]
    if control_signal_bits <= PDO_BITS - STATUSWORD.bits - ACTUAL_POSITION.bits:
        return (struct.Struct("<Hi" + signal),)
    return struct.Struct("<Hi"), struct.Struct("<" + signal)
