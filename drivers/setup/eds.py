"""EDS and DCF files, read leniently and with a report: real ones lack objects and carry foreign sections.

A file that breaks the rules of CiA 306 is read as far as it makes sense; what was passed over, mended or is
missing is said. Only a file with no object at all is refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from drivers.errors import DriveError
from drivers.frames.layout import rpdo_cob_id, tpdo_cob_id
from drivers.setup.device_file import DeviceFile, ObjectEntry
from drivers.setup.device_needs import missing_objects
from drivers.setup.eds_text import fields_of, number_of, sections_of, text_of
from drivers.setup.findings import Finding

_OBJECT = re.compile(r"^(?:0x)?([0-9A-F]{4})(?:\s*SUB\s*(?:0x)?([0-9A-F]{1,2}))?$", re.IGNORECASE)
_VALUES = re.compile(r"^([0-9A-F]{4})VALUE$", re.IGNORECASE)
_COMPACT = re.compile(r"^([0-9A-F]{4})(NAME|VALUE|DENOTATION)$", re.IGNORECASE)
_KNOWN = frozenset(
    {
        "FILEINFO",
        "DEVICEINFO",
        "DUMMYUSAGE",
        "COMMENTS",
        "MANDATORYOBJECTS",
        "OPTIONALOBJECTS",
        "MANUFACTUREROBJECTS",
        "DEVICECOMISSIONING",
        "DEVICECOMMISSIONING",
        "SUPPORTEDMODULES",
        "DYNAMICCHANNELS",
        "TOOLS",
    }
)
_LISTS = ("MANDATORYOBJECTS", "OPTIONALOBJECTS", "MANUFACTUREROBJECTS")


def read_device_file(path: Path, node_id: int) -> DeviceFile:
    """Read an EDS or DCF for one node.

    Args:
        path: the file.
        node_id: takes the place of $NODEID.

    Raises:
        DriveError: the file cannot be read, or has no object.
    """
    findings: list[Finding] = []
    sections = sections_of(text_of(path, findings), findings)
    objects: dict[tuple[int, int], ObjectEntry] = {}
    foreign = []
    for name, fields in sections.items():
        match = _OBJECT.match(name)
        if match is not None:
            _add_object(objects, match, fields, node_id, findings)
        elif name.upper() not in _KNOWN and not _COMPACT.match(name):
            foreign.append(name)
    for name, fields in sections.items():
        if (match := _VALUES.match(name)) is not None:
            _take_values(objects, int(match[1], 16), fields, node_id)
    if not objects:
        raise DriveError(f"{path}: has no object of a CANopen device; allowed: an EDS or DCF file (CiA 306)")
    info = fields_of(sections, "DEVICEINFO")
    add_compact_pdos(objects, info, node_id)
    if foreign:
        shown = ", ".join(foreign[:4]) + (" …" if len(foreign) > 4 else "")
        findings.append(Finding("info", "sections", f"{len(foreign)} foreign ones were passed over: {shown}"))
    _compare_lists(sections, objects, findings)
    findings += missing_objects(objects)
    commissioning = fields_of(sections, "DEVICECOMISSIONING") or fields_of(sections, "DEVICECOMMISSIONING")
    return DeviceFile(
        path=path,
        vendor=number_of(info.get("vendornumber"), 0),
        product=number_of(info.get("productnumber"), 0),
        revision=number_of(info.get("revisionnumber"), 0),
        node_id=number_of(commissioning.get("nodeid"), 0),
        objects=objects,
        findings=tuple(findings),
    )


def _add_object(
    objects: dict[tuple[int, int], ObjectEntry],
    match: re.Match[str],
    fields: Mapping[str, str],
    node_id: int,
    findings: list[Finding],
) -> None:
    index = int(match[1], 16)
    subindex = int(match[2], 16) if match[2] else 0
    kind = number_of(fields.get("objecttype"), node_id) or 7
    count = number_of(fields.get("compactsubobj"), node_id)
    if match[2] is None and kind in (8, 9) and not count:
        return  # a heading: its entries have sections of their own
    if count:
        _add_compact(objects, index, count, fields, node_id)
        return
    entry = _entry(index, subindex, fields, node_id)
    if fields.get("defaultvalue") and entry.default is None and entry.whole:
        text = f"default value {fields['defaultvalue']!r} is no number"
        findings.append(Finding("warning", f"{index:04X}:{subindex:02X}", text))
    objects[index, subindex] = entry


def _add_compact(
    objects: dict[tuple[int, int], ObjectEntry],
    index: int,
    count: int,
    fields: Mapping[str, str],
    node_id: int,
) -> None:
    """An array whose entries are all of one kind (CompactSubObj): entry 0 is their number."""
    for number in range(1, min(count, MOST_ENTRIES) + 1):
        objects.setdefault((index, number), _entry(index, number, fields, node_id))
    objects.setdefault((index, 0), plain_entry(index, 0, UNSIGNED8, "ro", count))


def _take_values(
    objects: dict[tuple[int, int], ObjectEntry], index: int, fields: Mapping[str, str], node_id: int
) -> None:
    """Values of a DCF for the entries of such an array."""
    for key, text in fields.items():
        subindex = number_of(key, 0)
        if subindex is not None and (entry := objects.get((index, subindex))) is not None:
            objects[index, subindex] = replace(entry, value=number_of(text, node_id))


def _entry(index: int, subindex: int, fields: Mapping[str, str], node_id: int) -> ObjectEntry:
    entry = ObjectEntry(
        index=index,
        subindex=subindex,
        name=fields.get("parametername", ""),
        data_type=number_of(fields.get("datatype"), node_id),
        access=fields.get("accesstype", "rw").lower(),
        default=number_of(fields.get("defaultvalue"), node_id),
        value=number_of(fields.get("parametervalue"), node_id),
        mappable=bool(number_of(fields.get("pdomapping"), node_id)),
    )
    low, high = (entry.as_value(number_of(fields.get(key), node_id)) for key in ("lowlimit", "highlimit"))
    return replace(entry, low=low, high=high) if low is None or high is None or low < high else entry


def _compare_lists(
    sections: Mapping[str, dict[str, str]],
    objects: Mapping[tuple[int, int], ObjectEntry],
    findings: list[Finding],
) -> None:
    """The file's own lists of objects beside the sections that it has."""
    listed: set[int] = set()
    for name in _LISTS:
        fields = fields_of(sections, name)
        numbers = {
            number
            for key, text in fields.items()
            if key.isdigit() and (number := number_of(text, 0)) is not None
        }
        stated = number_of(fields.get("supportedobjects"), 0)
        if stated is not None and stated != len(numbers):
            text = f"{name} says {stated} objects and lists {len(numbers)}"
            findings.append(Finding("info", "lists", text))
        listed |= numbers
    there = {index for index, _ in objects}
    for text, indices in (
        ("listed without a section", listed - there),
        ("with a section but in no list", there - listed),
    ):
        if indices and listed:
            shown = ", ".join(f"{index:04X}" for index in sorted(indices)[:6])
            more = f" and {len(indices) - 6} more" if len(indices) > 6 else ""
            findings.append(Finding("info", "lists", f"objects {text}: {shown}{more}"))


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
