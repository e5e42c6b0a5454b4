"""Process data objects of one drive: mapped in the order of CiA 301, 7.5.2.36, and read back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivers.cia402 import objects
from drivers.errors import DriveError
from drivers.frames.layout import (
    PDO_BITS,
    MappedObject,
    MappedPdo,
    rpdo_cob_id,
    rpdo_objects,
    tpdo_cob_id,
    tpdo_objects,
)
from drivers.setup.findings import Finding
from drivers.setup.sdo import SdoAccess, aborted
from drivers.setup.transmission import RECEIVED, SENT, set_type

DISABLED = 1 << 31
"""Bit 31 of a PDO's COB-ID entry: the PDO does not exist."""
NO_REMOTE_FRAMES = 1 << 30
MOST_PDOS = 64
_RESERVED = frozenset({0x000, 0x080, 0x100})
"""NMT, SYNC, TIME."""


@dataclass(frozen=True)
class PdoPlan:
    """The PDOs of one drive as they are after the set-up.

    Attributes:
        rpdo: COB-ID of the RPDO.
        tpdos: what answers a SYNC.
        idle: TPDOs that the drive sends besides, because it cannot be kept from it.
        findings: what is not as CiA 301 has it by default.
    """

    rpdo: int
    tpdos: tuple[MappedPdo, ...]
    idle: tuple[MappedPdo, ...] = ()
    findings: tuple[Finding, ...] = ()


def map_pdos(
    sdo: SdoAccess,
    node: int,
    control_signal: MappedObject,
    interpolated: bool,
    velocity: MappedObject | None = None,
) -> PdoPlan:
    """Map one RPDO and as many TPDOs as the cycle needs; switch every other PDO off.

    A PDO whose COB-ID or mapping the drive does not give away is used as it is where it holds what is needed.
    Where a TPDO has too few entries, the rest goes into the next one.

    Raises:
        DriveError: a refused or changed value; an object in no TPDO; a width that is not possible.
    """
    entries = [entry for entries in tpdo_objects(control_signal, velocity) for entry in entries]
    received = pdo_numbers(sdo, objects.RPDO_COMMUNICATION)
    sent = pdo_numbers(sdo, objects.TPDO_COMMUNICATION)
    findings: list[Finding] = []
    rpdo_number, rpdo = _map_rpdo(sdo, node, received, rpdo_objects(interpolated), findings)
    _silence(sdo, objects.RPDO_COMMUNICATION, [n for n in received if n != rpdo_number])
    used = _map_tpdos(sdo, node, sent, entries, findings)
    idle = _silence(sdo, objects.TPDO_COMMUNICATION, [n for n in sent if n not in used])
    for pdo in idle:
        text = f"cannot be switched off: COB-ID 0x{pdo.cob_id:03X} loads the bus besides"
        findings.append(Finding("warning", "TPDO", text))
    return PdoPlan(rpdo, tuple(used.values()), tuple(idle), tuple(findings))


def pdo_numbers(sdo: SdoAccess, first: int) -> list[int]:
    """Which PDOs a drive has, from 0: there may be more than four, and gaps between them.

    Args:
        sdo: the drive.
        first: index of the first one's communication parameters.
    """
    found: list[int] = []
    for number in range(MOST_PDOS):
        if sdo.read_optional(first + number, 1) is not None:
            found.append(number)
        elif number >= 4 and number - 1 not in found:
            break
    return found


def _silence(sdo: SdoAccess, first: int, numbers: list[int]) -> list[MappedPdo]:
    """Disable PDOs that are not used: they would load the bus or share a COB-ID. Those that stay on."""
    stay = []
    for number in numbers:
        word = sdo.read_int(first + number, 1)
        if word & DISABLED:
            continue
        try:
            sdo.write_checked(first + number, 1, word | DISABLED, 4)
        except DriveError as error:
            if aborted(error) is None:
                raise
            mapping = _mapping_of(first) + number
            # A TPDO without a mapped object is not sent (CiA 301, 7.5.2.38).
            if _refuses(lambda: sdo.write_checked(mapping, 0, 0, 1)):  # noqa: B023
                stay.append(MappedPdo(word & 0x7FF, mapped_objects(sdo, mapping)))
    return stay


def _mapping_of(first: int) -> int:
    return objects.RPDO_MAPPING if first == objects.RPDO_COMMUNICATION else objects.TPDO_MAPPING


def mapped_objects(sdo: SdoAccess, mapping: int) -> tuple[MappedObject, ...]:
    """What a PDO carries now."""
    words = [sdo.read_int(mapping, k + 1) for k in range(sdo.read_optional(mapping) or 0)]
    return tuple(MappedObject(word >> 16, word >> 8 & 0xFF, word & 0xFF) for word in words)


def _map_rpdo(
    sdo: SdoAccess,
    node: int,
    numbers: list[int],
    wanted: tuple[MappedObject, ...],
    findings: list[Finding],
) -> tuple[int, int]:
    """Number and COB-ID of the RPDO with controlword and set-point."""
    words = " and ".join(str(entry) for entry in wanted)
    if not numbers:
        raise DriveError(f"{sdo.drive}: has no RPDO (1400:01): set-points cannot be given in a cycle")
    usual, standing = rpdo_cob_id(node), list[str]()
    for number in numbers:
        communication, mapping = objects.RPDO_COMMUNICATION + number, objects.RPDO_MAPPING + number
        cob_id = _free(sdo, communication, usual, findings)
        left = _fill(sdo, mapping, list(wanted))
        if left is None or left:
            as_it_is = mapped_objects(sdo, mapping)
            standing.append(f"{mapping:04X}: {' '.join(map(str, as_it_is)) or 'nothing'}")
            if as_it_is != wanted:
                continue
            findings.append(Finding("info", f"{mapping:04X}", "the mapping is used as it is"))
        set_type(sdo, communication, RECEIVED, findings)
        _enable(sdo, communication, cob_id)
        return number, cob_id
    raise DriveError(
        f"{sdo.drive}: no RPDO can carry {words} alone ({'; '.join(standing)}): map both into one in the "
        "drive; controlword and set-point in two RPDOs are not spoken here"
    )


def _map_tpdos(
    sdo: SdoAccess,
    node: int,
    numbers: list[int],
    wanted: list[MappedObject],
    findings: list[Finding],
) -> dict[int, MappedPdo]:
    """By number, the TPDOs that carry the wanted objects."""
    used: dict[int, MappedPdo] = {}
    left = list(wanted)
    for number in numbers:
        if not left:
            break
        communication, mapping = objects.TPDO_COMMUNICATION + number, objects.TPDO_MAPPING + number
        cob_id = _free(sdo, communication, _usual_tpdo(sdo, node, number), findings)
        rest = _fill(sdo, mapping, left)
        carried = mapped_objects(sdo, mapping)
        if rest is None:  # it cannot be mapped anew
            rest = [entry for entry in left if entry not in carried]
            if len(rest) == len(left):
                continue
            findings.append(Finding("info", f"{mapping:04X}", "the mapping is used as it is"))
        elif len(rest) == len(left):
            continue
        left = rest
        set_type(sdo, communication, SENT, findings)
        _enable(sdo, communication, cob_id)
        used[number] = MappedPdo(cob_id, carried)
    if left:
        names = " and ".join(str(entry) for entry in left)
        raise DriveError(
            f"{sdo.drive}: no TPDO has room for {names}: it may not be mappable: map it yourself, or "
            "name another object as control_signal"
        )
    return used


def _usual_tpdo(sdo: SdoAccess, node: int, number: int) -> int:
    """The COB-ID of the predefined connection set; of the fifth and later PDOs the drive's own."""
    if number < 4:
        return tpdo_cob_id(node) + 0x100 * number
    return sdo.read_int(objects.TPDO_COMMUNICATION + number, 1) & 0x7FF


def _free(sdo: SdoAccess, communication: int, usual: int, findings: list[Finding]) -> int:
    """Disable a PDO so that it can be mapped; its COB-ID: the usual one, or the drive's where it is fixed."""
    try:
        sdo.write(communication, 1, usual | DISABLED, 4)
    except DriveError as error:
        if aborted(error) is None:
            raise
        own = sdo.read_int(communication, 1)
        text = f"the COB-ID is fixed, 0x{own & 0x7FF:03X}: used as it is"
        findings.append(Finding("info", f"{communication:04X}", text))
        return own & 0x7FF
    return usual


def _fill(sdo: SdoAccess, mapping: int, wanted: list[MappedObject]) -> list[MappedObject] | None:
    """Map as many of the objects, in their order, as there is room for.

    Returns:
        Those that found no room; None where the mapping cannot be written at all.
    """
    if _refuses(lambda: sdo.write(mapping, 0, 0, 1)):
        return None
    count = bits = 0
    for entry in wanted:
        bits += entry.bits
        if bits > PDO_BITS or not _accepts(sdo, mapping, count + 1, entry):
            break
        count += 1
    while count and _refuses(lambda: sdo.write_checked(mapping, 0, count, 1)):  # noqa: B023
        count -= 1  # some drives judge only here what fits
    return wanted[count:]


def _accepts(sdo: SdoAccess, mapping: int, number: int, entry: MappedObject) -> bool:
    return not _refuses(lambda: sdo.write_checked(mapping, number, entry.word, 4))


def _refuses(write: Callable[[], None]) -> bool:
    """Whether the drive aborts a write; silence, and a value that reads back otherwise, are raised."""
    try:
        write()
    except DriveError as error:
        if aborted(error) is None:
            raise
        return True
    return False


def _enable(sdo: SdoAccess, communication: int, cob_id: int) -> None:
    found = sdo.read_int(communication, 1)
    if found & ~NO_REMOTE_FRAMES != cob_id:
        sdo.write(communication, 1, cob_id, 4)
        found = sdo.read_int(communication, 1)
    # Bit 30 (no remote frames) is the drive's own affair; id and validity are ours.
    if found & ~NO_REMOTE_FRAMES != cob_id:
        raise DriveError(
            f"{sdo.drive}: {communication:04X}:01 was set to 0x{cob_id:X} but reads back as 0x{found:X}"
        )


def transmitted_cob_ids(sdo: SdoAccess) -> dict[int, str]:
    """COB-IDs that a drive sends on as it is configured now, and which object says so."""
    sent = {}
    for number in pdo_numbers(sdo, objects.TPDO_COMMUNICATION):
        word = sdo.read_int(objects.TPDO_COMMUNICATION + number, 1)
        if not word & DISABLED:
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
