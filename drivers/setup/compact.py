"""What EDS files leave out because it follows from a number (CiA 306): PDOs of CompactPDO."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.frames.layout import rpdo_cob_id, tpdo_cob_id
from drivers.setup.device_file import ObjectEntry
from drivers.setup.eds_text import number_of

UNSIGNED8, UNSIGNED16, UNSIGNED32 = 5, 6, 7
MOST_ENTRIES = 254
_SLOTS = 8
_DISABLED = 1 << 31
_EVENT_DRIVEN = 255
_PREDEFINED = 4
"""PDOs that have a COB-ID by the predefined connection set."""
_PARAMETERS = {1: UNSIGNED32, 2: UNSIGNED8, 3: UNSIGNED16, 5: UNSIGNED16}
"""Data types of the entries of 1400h and 1800h; bit *n* − 1 of CompactPDO says whether there is entry *n*."""


def plain_entry(index: int, subindex: int, data_type: int, access: str, default: int) -> ObjectEntry:
    """An entry that the file does not describe by itself."""
    return ObjectEntry(index, subindex, "", data_type, access, default, None, mappable=False)


def add_compact_pdos(
    objects: dict[tuple[int, int], ObjectEntry], info: Mapping[str, str], node_id: int
) -> None:
    """Add the PDOs that DeviceInfo counts and no section describes.

    Args:
        objects: what the file describes.
        info: the fields of its DeviceInfo.
        node_id: of the drive.
    """
    there = number_of(info.get("compactpdo"), 0)
    if not there:
        return
    for count, first, mapping, usual in (
        ("nrofrxpdo", 0x1400, 0x1600, rpdo_cob_id(node_id)),
        ("nroftxpdo", 0x1800, 0x1A00, tpdo_cob_id(node_id)),
    ):
        for number in range(min(number_of(info.get(count), 0) or 0, 512)):
            if (first + number, 1) in objects:
                continue
            cob_id = usual + 0x100 * number if number < _PREDEFINED else _DISABLED
            defaults = {1: cob_id, 2: _EVENT_DRIVEN}
            entries = {s: kind for s, kind in _PARAMETERS.items() if there >> (s - 1) & 1 or s <= 2}
            _add(objects, first + number, entries, defaults)
            _add(objects, mapping + number, dict.fromkeys(range(1, _SLOTS + 1), UNSIGNED32), {})


def _add(
    objects: dict[tuple[int, int], ObjectEntry],
    index: int,
    entries: Mapping[int, int],
    defaults: Mapping[int, int],
) -> None:
    """A record, unless the file describes parts of it."""
    mapping = 0x1600 <= index < 0x1800 or index >= 0x1A00
    head = plain_entry(index, 0, UNSIGNED8, "rw" if mapping else "ro", 0 if mapping else max(entries))
    objects.setdefault((index, 0), head)
    for subindex, kind in entries.items():
        entry = plain_entry(index, subindex, kind, "rw", defaults.get(subindex, 0))
        objects.setdefault((index, subindex), entry)
