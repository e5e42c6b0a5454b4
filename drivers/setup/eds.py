"""EDS and DCF files, read leniently and with a report: real ones lack objects and carry foreign sections.

A file that breaks the rules of CiA 306 is read as far as it makes sense; what was passed over, mended or is
missing is said. Only a file with no object at all is refused.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from drivers.errors import DriveError
from drivers.setup.findings import Finding

MAX_BYTES = 16 << 20
_OBJECT = re.compile(r"^([0-9A-F]{4})(?:SUB([0-9A-F]{1,2}))?$", re.IGNORECASE)
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
_NODE_ID = re.compile(r"\$NODEID", re.IGNORECASE)
_BITS = {
    1: 1,
    2: 8,
    3: 16,
    4: 32,
    5: 8,
    6: 16,
    7: 32,
    8: 32,
    0x10: 24,
    0x11: 64,
    0x15: 64,
    0x16: 24,
    0x1B: 64,
}
"""Length by data type; others are strings and domains."""

NEEDED: dict[tuple[int, int], tuple[str, str]] = {
    (0x1018, 1): ("refusal", "identity: nothing tells this drive from another"),
    (0x6040, 0): ("refusal", "controlword: the drive cannot be enabled"),
    (0x6041, 0): ("refusal", "statusword: nobody knows its state"),
    (0x6060, 0): ("refusal", "modes of operation"),
    (0x6061, 0): ("refusal", "mode display: a refused mode would not show"),
    (0x6064, 0): ("refusal", "actual position"),
    (0x60C2, 1): ("refusal", "interpolation period: the drive does not know the SYNC period"),
    (0x1600, 1): ("refusal", "RPDO mapping"),
    (0x1A00, 1): ("refusal", "TPDO mapping"),
    (0x1016, 1): ("warning", "heartbeat consumer: the drive notices no lost master by it"),
    (0x1017, 0): ("warning", "heartbeat producer: only missing TPDOs show a dead drive"),
    (0x6007, 0): ("info", "abort option: the reaction to a lost master cannot be chosen"),
    (0x605A, 0): ("info", "quick stop option: how halt stops is the drive's own affair"),
    (0x605E, 0): ("info", "fault reaction option"),
    (0x6065, 0): ("warning", "following error window: only the master watches"),
    (0x6076, 0): ("info", "rated torque: torque limits cannot be compared, gain is configuration"),
    (0x607D, 1): ("warning", "software position limits"),
    (0x608F, 1): ("info", "encoder resolution: encoder_counts cannot be cross-checked"),
    (0x6091, 1): ("info", "gear ratio: gear cannot be cross-checked"),
    (0x6502, 0): ("warning", "supported modes: csp is tried"),
}
"""What the set-up uses, with what its absence means."""
SET_POINTS = ((0x607A, 0), (0x60C1, 1))
CONTROL_SIGNALS = ((0x6077, 0), (0x6074, 0), (0x6078, 0))


@dataclass(frozen=True)
class ObjectEntry:
    """One sub-object as the file has it.

    Attributes:
        index, subindex, name: which.
        data_type: number of CiA 301, table 44; None where the file does not say.
        access: ``ro``, ``rw``, ``wo``, ``const``, ``rwr`` or ``rww``.
        default: value after a reset; None where there is none, or it is no number.
        value: of a DCF; None in an EDS.
        mappable: whether a PDO may carry it.
    """

    index: int
    subindex: int
    name: str
    data_type: int | None
    access: str
    default: int | None
    value: int | None
    mappable: bool

    @property
    def bits(self) -> int | None:
        """Length of an integer; None for anything else."""
        return _BITS.get(self.data_type or 0)


@dataclass(frozen=True)
class DeviceFile:
    """An EDS or DCF.

    Attributes:
        path: the file.
        vendor, product, revision: of its DeviceInfo; None where it does not say.
        node_id: of a DCF's commissioning.
        objects: by index and subindex.
        findings: what is wrong with the file, and what the master would miss.
    """

    path: Path
    vendor: int | None
    product: int | None
    revision: int | None
    node_id: int | None
    objects: Mapping[tuple[int, int], ObjectEntry]
    findings: tuple[Finding, ...]

    def has(self, index: int, subindex: int = 0) -> bool:
        """Whether the file has such a sub-object."""
        return (index, subindex) in self.objects

    def transmitted_cob_ids(self) -> dict[int, str]:
        """COB-IDs that a drive with these values sends on, and the objects that say so."""
        sent = {}
        for index in (*range(0x1800, 0x1804), 0x1014):
            entry = self.objects.get((index, 0 if index == 0x1014 else 1))
            if entry is None:
                continue
            word = entry.value if entry.value is not None else entry.default
            if word is not None and not word >> 31:
                sent[word & 0x7FF] = f"{index:04X}"
        return sent


def read_device_file(path: Path, node_id: int) -> DeviceFile:
    """Read an EDS or DCF for one node.

    Args:
        path: the file.
        node_id: takes the place of $NODEID.

    Raises:
        DriveError: the file cannot be read, or has no object.
    """
    findings: list[Finding] = []
    sections = _sections(_text(path, findings), findings)
    objects: dict[tuple[int, int], ObjectEntry] = {}
    foreign = []
    for name, fields in sections.items():
        match = _OBJECT.match(name)
        if match is not None:
            _add_object(objects, match, fields, node_id, findings)
        elif name.upper() not in _KNOWN and not _COMPACT.match(name):
            foreign.append(name)
    if not objects:
        raise DriveError(f"{path}: has no object of a CANopen device; allowed: an EDS or DCF file (CiA 306)")
    if foreign:
        shown = ", ".join(foreign[:4]) + (" …" if len(foreign) > 4 else "")
        findings.append(Finding("info", "sections", f"{len(foreign)} foreign ones were passed over: {shown}"))
    _compare_lists(sections, objects, findings)
    findings += missing_objects(objects)
    info = _fields(sections, "DEVICEINFO")
    commissioning = _fields(sections, "DEVICECOMISSIONING") or _fields(sections, "DEVICECOMMISSIONING")
    return DeviceFile(
        path=path,
        vendor=_number(info.get("vendornumber"), 0),
        product=_number(info.get("productnumber"), 0),
        revision=_number(info.get("revisionnumber"), 0),
        node_id=_number(commissioning.get("nodeid"), 0),
        objects=objects,
        findings=tuple(findings),
    )


def missing_objects(objects: Mapping[tuple[int, int], ObjectEntry]) -> list[Finding]:
    """What the master would use and the device does not have, by severity."""
    found = []
    for (index, subindex), (severity, meaning) in NEEDED.items():
        if (index, subindex) not in objects:
            subject = f"{index:04X}" + (f":{subindex:02X}" if subindex else "")
            found.append(Finding(severity, subject, f"absent: {meaning}"))  # type: ignore[arg-type]
    if not any(key in objects for key in SET_POINTS):
        found.append(Finding("refusal", "607A", "absent, and no 60C1: the drive takes no set-points"))
    elif SET_POINTS[0] not in objects:
        found.append(Finding("info", "607A", "absent: interpolated position mode is used (60C1)"))
    standard = [key for key in CONTROL_SIGNALS if key in objects]
    if not standard:
        text = "absent, and no 6074 or 6078: name the maker's own object as control_signal"
        found.append(Finding("warning", "6077", text))
    elif not any(objects[key].mappable for key in standard):
        found.append(Finding("warning", "6077", "no standard control signal can be mapped into a PDO"))
    return found


def compare_identity(file: DeviceFile, found: tuple[int | None, int | None, int | None]) -> list[Finding]:
    """The file's identity beside the drive's (1018h): vendor, product, revision.

    Another vendor or product is refused: the file is of another device. Revisions differ in practice.
    """
    compared = []
    wanted = (("vendor", file.vendor), ("product", file.product), ("revision", file.revision))
    for (name, value), actual in zip(wanted, found, strict=True):
        if value is None or actual is None or value == actual:
            continue
        text = f"{file.path.name} is of {name} 0x{value:08X}, the drive says 0x{actual:08X}"
        compared.append(Finding("info" if name == "revision" else "refusal", "identity", text))
    return compared


# Reading -------------------------------------------------------------------------------------


def _text(path: Path, findings: list[Finding]) -> str:
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise DriveError(f"{path}: cannot be read: {error.strerror}; allowed: an EDS or DCF file") from None
    if len(content) > MAX_BYTES:
        raise DriveError(f"{path}: larger than {MAX_BYTES} bytes; allowed: an EDS or DCF file")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        findings.append(Finding("info", "text", "not UTF-8, read as Windows-1252"))
        return content.decode("cp1252", errors="replace")


def _sections(text: str, findings: list[Finding]) -> dict[str, dict[str, str]]:
    """Sections as dicts of lower-case keys; names keep their spelling, the first one of its kind wins."""
    sections: dict[str, dict[str, str]] = {}
    names: dict[str, str] = {}
    current: dict[str, str] | None = None
    strange, doubled = 0, Counter[str]()
    for raw in text.splitlines():
        line = raw.strip()
        if not line or line.startswith((";", "#")):
            continue
        if line.startswith("[") and "]" in line:
            name = line[1 : line.index("]")].strip()
            if name.upper() in names:
                doubled[name.upper()] += 1
                current = sections[names[name.upper()]]
            else:
                names[name.upper()] = name
                current = sections[name] = {}
            continue
        key, equals, value = line.partition("=")
        if not equals or current is None:
            strange += 1
            continue
        current.setdefault(key.strip().lower(), value.split(";", 1)[0].strip())
    if strange:
        findings.append(
            Finding("info", "lines", f"{strange} that are neither section nor key were passed over")
        )
    if doubled:
        shown = ", ".join(sorted(doubled)[:4])
        findings.append(Finding("warning", "sections", f"there twice, taken together: {shown}"))
    return sections


def _fields(sections: Mapping[str, dict[str, str]], name: str) -> dict[str, str]:
    return next((fields for key, fields in sections.items() if key.upper() == name), {})


def _number(text: str | None, node_id: int) -> int | None:
    """A number as EDS files write it: decimal, 0x…, octal with a leading zero, and with $NODEID."""
    if text is None or not text.strip():
        return None
    total = 0
    for part in _NODE_ID.sub(str(node_id), text).replace(" ", "").split("+"):
        try:
            total += int(part, 8) if re.fullmatch(r"0[0-7]+", part) else int(part, 0)
        except ValueError:
            return None
    return total


def _add_object(
    objects: dict[tuple[int, int], ObjectEntry],
    match: re.Match[str],
    fields: Mapping[str, str],
    node_id: int,
    findings: list[Finding],
) -> None:
    index = int(match[1], 16)
    subindex = int(match[2], 16) if match[2] else 0
    kind = _number(fields.get("objecttype"), node_id) or 7
    count = _number(fields.get("compactsubobj"), node_id)
    if match[2] is None and kind in (8, 9) and not count:
        return  # a heading: its entries have sections of their own
    entry = _entry(index, subindex, fields, node_id)
    if fields.get("defaultvalue") and entry.default is None and entry.bits is not None:
        text = f"default value {fields['defaultvalue']!r} is no number"
        findings.append(Finding("warning", f"{index:04X}:{subindex:02X}", text))
    if count:
        for number in range(1, count + 1):
            objects.setdefault((index, number), _entry(index, number, fields, node_id))
    objects[index, subindex] = entry


def _entry(index: int, subindex: int, fields: Mapping[str, str], node_id: int) -> ObjectEntry:
    return ObjectEntry(
        index=index,
        subindex=subindex,
        name=fields.get("parametername", ""),
        data_type=_number(fields.get("datatype"), node_id),
        access=fields.get("accesstype", "rw").lower(),
        default=_number(fields.get("defaultvalue"), node_id),
        value=_number(fields.get("parametervalue"), node_id),
        mappable=bool(_number(fields.get("pdomapping"), node_id)),
    )


def _compare_lists(
    sections: Mapping[str, dict[str, str]],
    objects: Mapping[tuple[int, int], ObjectEntry],
    findings: list[Finding],
) -> None:
    """The file's own lists of objects beside the sections that it has."""
    listed: set[int] = set()
    for name in _LISTS:
        fields = _fields(sections, name)
        numbers = {
            number
            for key, text in fields.items()
            if key.isdigit() and (number := _number(text, 0)) is not None
        }
        stated = _number(fields.get("supportedobjects"), 0)
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
