"""Process data objects of one drive: mapped in the order of CiA 301, 7.5.2.36, and read back."""

from __future__ import annotations

from drivers.cia402 import objects
from drivers.cyclic.layout import (
    MappedObject,
    rpdo_cob_id,
    rpdo_objects,
    second_tpdo_cob_id,
    tpdo_cob_id,
    tpdo_objects,
)
from drivers.errors import DriveError
from drivers.setup.sdo import SdoAccess

DISABLED = 1 << 31
"""Bit 31 of a PDO's COB-ID entry: the PDO does not exist."""
SYNCHRONOUS = 1
"""Transmission type: at every SYNC."""
_PDOS = range(4)
_RESERVED = frozenset({0x000, 0x080, 0x100})
"""NMT, SYNC, TIME."""


def map_pdos(
    sdo: SdoAccess,
    node: int,
    control_signal: MappedObject,
    interpolated: bool,
    velocity: MappedObject | None = None,
) -> None:
    """Map one RPDO and as many TPDOs as the cycle needs; switch every other PDO off.

    Raises:
        DriveError: a refused or changed value; control signal or velocity has no possible width.
    """
    tpdos = tpdo_objects(control_signal, velocity)
    silence_pdos(sdo, objects.RPDO_COMMUNICATION, used=1)
    silence_pdos(sdo, objects.TPDO_COMMUNICATION, used=len(tpdos))
    _map(
        sdo,
        objects.RPDO_COMMUNICATION,
        objects.RPDO_MAPPING,
        rpdo_cob_id(node),
        rpdo_objects(interpolated),
    )
    for number, entries in enumerate(tpdos):
        cob_id = (tpdo_cob_id, second_tpdo_cob_id)[number](node)
        _map(sdo, objects.TPDO_COMMUNICATION + number, objects.TPDO_MAPPING + number, cob_id, entries)


def silence_pdos(sdo: SdoAccess, first: int, used: int) -> None:
    """Disable the PDOs that are not used: they would load the bus or share a COB-ID."""
    for number in _PDOS[used:]:
        cob_id = sdo.read_optional(first + number, 1)
        if cob_id is not None and not cob_id & DISABLED:
            sdo.write_checked(first + number, 1, cob_id | DISABLED, 4)


def _map(
    sdo: SdoAccess, communication: int, mapping: int, cob_id: int, entries: tuple[MappedObject, ...]
) -> None:
    sdo.write(communication, 1, cob_id | DISABLED, 4)
    sdo.write(mapping, 0, 0, 1)
    for number, entry in enumerate(entries, start=1):
        sdo.write_checked(mapping, number, entry.word, 4)
    sdo.write_checked(mapping, 0, len(entries), 1)
    sdo.write_checked(communication, 2, SYNCHRONOUS, 1)
    sdo.write(communication, 1, cob_id, 4)
    # Bit 30 (no remote frames) is the drive's own affair; id and validity are ours.
    found = sdo.read_int(communication, 1)
    if found & ~(1 << 30) != cob_id:
        raise DriveError(
            f"{sdo.drive}: {communication:04X}:01 was set to 0x{cob_id:X} but reads back as 0x{found:X}"
        )


def transmitted_cob_ids(sdo: SdoAccess) -> dict[int, str]:
    """COB-IDs that a drive sends on as it is configured now, and which object says so."""
    sent = {}
    for number in _PDOS:
        word = sdo.read_optional(objects.TPDO_COMMUNICATION + number, 1)
        if word is not None and not word & DISABLED:
            sent[word & 0x7FF] = f"{objects.TPDO_COMMUNICATION + number:04X}:01"
    emcy = sdo.read_optional(objects.EMCY_COB_ID)
    if emcy is not None and not emcy & DISABLED:
        sent[emcy & 0x7FF] = f"{objects.EMCY_COB_ID:04X}"
    return sent


def refuse_shared_cob_ids(sent: dict[str, dict[int, str]]) -> None:
    """Two nodes must not send on one id: a DCF with fixed ids, loaded into several drives, makes them.

    Args:
        sent: by drive, what :func:`transmitted_cob_ids` found.

    Raises:
        DriveError: the first id that two drives share, or that is nobody's to send.
    """
    owner: dict[int, str] = {}
    for drive, cob_ids in sent.items():
        for cob_id, source in cob_ids.items():
            if cob_id in _RESERVED:
                raise DriveError(f"{drive}: {source} holds COB-ID 0x{cob_id:03X}, which no drive may send on")
            if cob_id in owner:
                raise DriveError(f"{drive}: {source} holds COB-ID 0x{cob_id:03X}, as {owner[cob_id]} does")
            owner[cob_id] = drive
