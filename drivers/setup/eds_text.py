"""The text of EDS and DCF files: sections, keys and numbers as makers write them (CiA 306)."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from drivers.errors import DriveError
from drivers.setup.findings import Finding

MAX_BYTES = 16 << 20
_NO_MEANING = str.maketrans("", "", " \t()")
_FORMS = (
    (re.compile(r"0([0-7]+)"), 8),
    (re.compile(r"0+(\d+)"), 10),
    (re.compile(r"(-?\d+)\.0*"), 10),
    (re.compile(r"([0-9a-f]+)h", re.IGNORECASE), 16),
)
_TRUTHS = {"true": 1, "yes": 1, "false": 0, "no": 0}
_NODE_ID = re.compile(r"\$?NODE_?ID", re.IGNORECASE)


def text_of(path: Path, findings: list[Finding]) -> str:
    """The text of a file, in whichever of three encodings it is.

    Raises:
        DriveError: it cannot be read, or is far too large.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise DriveError(f"{path}: cannot be read: {error.strerror}; allowed: an EDS or DCF file") from None
    if len(content) > MAX_BYTES:
        raise DriveError(f"{path}: larger than {MAX_BYTES} bytes; allowed: an EDS or DCF file")
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        findings.append(Finding("info", "text", "not UTF-8, read as Windows-1252"))
        return content.decode("cp1252", errors="replace")


def sections_of(text: str, findings: list[Finding]) -> dict[str, dict[str, str]]:
    """Sections as dicts of lower-case keys; names keep their spelling, the first one of its kind wins."""
    sections: dict[str, dict[str, str]] = {}
    names: dict[str, str] = {}
    current: dict[str, str] | None = None
    ignored, doubled = 0, Counter[str]()
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
            ignored += 1
            continue
        current.setdefault(key.strip().lower(), value.split(";", 1)[0].strip().strip("\"'"))
    if ignored:
        findings.append(
            Finding("info", "lines", f"{ignored} that are neither section nor key were passed over")
        )
    if doubled:
        shown = ", ".join(sorted(doubled)[:4])
        findings.append(Finding("warning", "sections", f"there twice, taken together: {shown}"))
    return sections


def fields_of(sections: Mapping[str, dict[str, str]], name: str) -> dict[str, str]:
    """The keys of a section, by its name in capitals; none where there is no such section."""
    return next((fields for key, fields in sections.items() if key.upper() == name), {})


def number_of(text: str | None, node_id: int) -> int | None:
    """A number as EDS files write it: decimal, 0x…, octal with a leading zero, and with $NODEID.

    Beside CiA 306 there are 1Ah, 08 (which is no octal), 0.0 for a whole number, and TRUE.
    """
    if text is None or not text.strip():
        return None
    total = 0
    for part in _NODE_ID.sub(str(node_id), text).translate(_NO_MEANING).split("+"):
        number = _part(part)
        if number is None:
            return None
        total += number
    return total


def _part(text: str) -> int | None:
    for pattern, base in _FORMS:
        if (match := pattern.fullmatch(text)) is not None:
            return int(match[1], base)
    try:
        return int(text, 0)
    except ValueError:
        return _TRUTHS.get(text.lower())
