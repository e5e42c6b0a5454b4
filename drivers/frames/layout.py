"""What the process data objects carry, byte by byte, as precompiled layouts."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Literal

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

Field = Literal["statusword", "position", "control_signal", "velocity"]
"""What the cycle takes from a TPDO."""


@dataclass(frozen=True)
class MappedPdo:
    """A TPDO as a drive has it mapped."""

    cob_id: int
    objects: tuple[MappedObject, ...]


@dataclass(frozen=True)
class TpdoLayout:
    """A TPDO as the cycle reads it: which fields, by which layout; what is not needed is passed over."""

    cob_id: int
    layout: struct.Struct
    fields: tuple[Field, ...]


@dataclass(frozen=True)
class DriveLink:
    """How one drive is spoken to in the cycle.

    Attributes:
        node: node id.
        name: how messages name the drive.
        control_signal_bits: width of the control signal; above 16 it is in a second TPDO.
        velocity_bits: width of the velocity, which is in a second TPDO; 0 where it is not sent.
        interpolated: whether the drive runs in interpolated position mode (ip) and not in csp.
        heartbeat: s between the drive's heartbeats (1017h); 0 where it sends none.
        watches: whether the drive's heartbeat consumer (1016h) is set to this master.
        rpdo: COB-ID of its RPDO; 0x200 + node where 0.
        tpdos: its TPDOs as they are mapped; by the widths above where there are none.
        control_signal, velocity: the objects that carry them, for ``tpdos``.
        idle_tpdos: further TPDOs, which it cannot be kept from sending.
        warnings: EMCY codes that are no faults of this kind of drive.
        tpdo_delay: s that its TPDOs may come after the SYNC beside what the machine needs.
    """

    node: int
    name: str
    control_signal_bits: int = 16
    velocity_bits: int = 0
    interpolated: bool = False
    heartbeat: float = 0.0
    watches: bool = False
    rpdo: int = 0
    tpdos: tuple[MappedPdo, ...] = ()
    control_signal: MappedObject | None = None
    velocity: MappedObject | None = None
    idle_tpdos: tuple[MappedPdo, ...] = ()
    warnings: frozenset[int] = frozenset()
    tpdo_delay: float = 0.0

    @property
    def rpdo_cob_id(self) -> int:
        """Where the drive takes controlword and set-point."""
        return self.rpdo or rpdo_cob_id(self.node)

    def transmitted(self) -> tuple[TpdoLayout, ...]:
        """The TPDOs with which the drive answers a SYNC."""
        if self.tpdos:
            return tuple(self._read(pdo) for pdo in self.tpdos)
        layouts = tpdo_layouts(self.control_signal_bits, self.velocity_bits)
        beside = fits_beside_position(self.control_signal_bits)
        state: tuple[Field, ...] = ("statusword", "position")
        signal: tuple[Field, ...] = ("control_signal",)
        rest: tuple[Field, ...] = ("velocity",) if self.velocity_bits else ()
        fields = (state + signal, rest) if beside else (state, signal + rest)
        cob_ids = tpdo_cob_id(self.node), second_tpdo_cob_id(self.node)
        return tuple(
            TpdoLayout(*each)
            for each in zip(cob_ids[: len(layouts)], layouts, fields[: len(layouts)], strict=True)
        )

    def _read(self, pdo: MappedPdo) -> TpdoLayout:
        known: dict[MappedObject | None, Field] = {
            STATUSWORD: "statusword",
            ACTUAL_POSITION: "position",
            self.control_signal: "control_signal",
            self.velocity: "velocity",
        }
        form, fields = "<", []
        for entry in pdo.objects:
            field = known.get(entry)
            if field is None:
                form += f"{entry.bits // 8}x"
                continue
            form += "H" if field == "statusword" else SIGNED_FORMATS[entry.bits]
            fields.append(field)
        return TpdoLayout(pdo.cob_id, struct.Struct(form), tuple(fields))


def rpdo_objects(interpolated: bool) -> tuple[MappedObject, ...]:
    """Controlword and set-point: 607Ah in csp, 60C1h:01 in interpolated position mode."""
    return CONTROLWORD, INTERPOLATION_DATA if interpolated else TARGET_POSITION


def tpdo_objects(
    control_signal: MappedObject, velocity: MappedObject | None = None
) -> tuple[tuple[MappedObject, ...], ...]:
    """What the drive's TPDOs carry: one where all fits into its eight bytes, else two of the same SYNC.

    Raises:
        DriveError: the control-signal or the velocity object is no integer of 8, 16 or 32 bits.
    """
    for name, found in (("control-signal", control_signal), ("velocity", velocity)):
        if found is not None and found.bits not in SIGNED_FORMATS:
            allowed = ", ".join(str(bits) for bits in SIGNED_FORMATS)
            raise DriveError(f"{name} object {found} has {found.bits} bits; allowed: {allowed}")
    first, second = [STATUSWORD, ACTUAL_POSITION], [] if velocity is None else [velocity]
    if fits_beside_position(control_signal.bits):
        first.append(control_signal)
    else:
        second.insert(0, control_signal)
    return tuple(tuple(entries) for entries in (first, second) if entries)


def fits_beside_position(control_signal_bits: int) -> bool:
    """Whether a control signal has room in the TPDO of statusword and actual position."""
    return control_signal_bits <= PDO_BITS - STATUSWORD.bits - ACTUAL_POSITION.bits


def tpdo_layouts(control_signal_bits: int, velocity_bits: int = 0) -> tuple[struct.Struct, ...]:
    """One layout per TPDO: statusword and actual position, and what is in :func:`tpdo_objects` beside them.

    Args:
        control_signal_bits: width of the control signal.
        velocity_bits: width of the velocity; 0 where it is not sent.
    """
    first, second = "<Hi", "" if not velocity_bits else SIGNED_FORMATS[velocity_bits]
    signal = SIGNED_FORMATS[control_signal_bits]
    if fits_beside_position(control_signal_bits):
        first += signal
    else:
        second = signal + second
    return tuple(struct.Struct(form) for form in (first, *(["<" + second] if second else [])))
