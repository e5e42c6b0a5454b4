"""EDS and DCF files as tools and makers write them, beside CiA 306: the same drive comes of each."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from drivers.setup.device_file import DeviceFile
from drivers.setup.eds import read_device_file
from drivers.setup.eds_text import number_of
from drivers.setup.foresee import foresee
from robots import Robot
from tests.drivers.setup.test_foresee import without

NODE = 5
KNOWN = {
    "x608Fsub1_DefaultValue": "196608",
    "x6091sub1_DefaultValue": "32",
    "x6092sub1_DefaultValue": "6291456",
}


def hexadecimal(text: str) -> str:
    return re.sub(r"(DefaultValue|DataType)=(\d+)\b", lambda m: f"{m[1]}={int(m[2]):X}h", text)


def bare_keys(text: str) -> str:
    return re.sub(r"^(\w+)=", lambda m: m[1].lower() + " = ", text, flags=re.MULTILINE)


def shouted(text: str) -> str:
    return re.sub(r"^\[.*\]$", lambda m: m[0].upper(), text, flags=re.MULTILINE)


def spaced(text: str) -> str:
    return re.sub(r"^\[(\w{4})sub(\w)\]$", r"[0x\1 sub 0x\2]", text, flags=re.MULTILINE)


def commented(text: str) -> str:
    return re.sub(r"=(\S+)$", r'="\1" ; as delivered', text, flags=re.MULTILINE)


def truths(text: str) -> str:
    return text.replace("PDOMapping=1", "PDOMapping=TRUE").replace("PDOMapping=0", "PDOMapping=No")


def other_node_ids(text: str) -> str:
    return text.replace("$NODEID+0x180", "(0x180 + $NodeId)").replace("$NODEID+0x200", "512+NODEID")


def points(text: str) -> str:
    return re.sub(r"DefaultValue=(\d+)$", r"DefaultValue=\1.0", text, flags=re.MULTILINE)


def as_dcf(text: str) -> str:
    """Values beside defaults that are no longer so."""
    moved = re.sub(r"^DefaultValue=(\d+)$", r"DefaultValue=77\nParameterValue=\1", text, flags=re.MULTILINE)
    return moved + "\n[DeviceComissioning]\nNodeID=5\nBaudrate=1000\n"


TOOLS: dict[str, Callable[[str], str]] = {
    "hexadecimal with h": hexadecimal,
    "keys in small letters, with spaces": bare_keys,
    "sections in capitals": shouted,
    "sections with spaces and 0x": spaced,
    "quotes and comments": commented,
    "truths in words": truths,
    "other forms of $NODEID": other_node_ids,
    "whole numbers with a point": points,
    "a DCF": as_dcf,
}


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    return without(tmp_path, **KNOWN)


def told(robot: Robot, path: Path) -> list[str]:
    return [str(finding) for finding in foresee(robot, 0, read_device_file(path, NODE))]


def values(file: DeviceFile) -> dict[tuple[int, int], object]:
    return {
        key: (entry.value if entry.value is not None else entry.default, entry.bits, entry.mappable)
        for key, entry in file.objects.items()
    }


@pytest.mark.parametrize("tool", TOOLS)
def test_each_tool_writes_the_same_drive(tx40: Robot, plain: Path, tmp_path: Path, tool: str) -> None:
    text = plain.read_text("utf-8")
    other = tmp_path / "other.eds"
    other.write_text(TOOLS[tool](text), "utf-8")
    assert other.read_text("utf-8") != text
    assert values(read_device_file(other, NODE)) == values(read_device_file(plain, NODE))
    assert told(tx40, other) == told(tx40, plain)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16", "utf-16-be-bom"])
def test_in_each_encoding(tx40: Robot, plain: Path, tmp_path: Path, encoding: str) -> None:
    text = plain.read_text("utf-8").replace("ParameterName=", "ParameterName=Größe ", 1)
    other = tmp_path / "other.eds"
    if encoding == "utf-16-be-bom":
        other.write_bytes(b"\xfe\xff" + text.encode("utf-16-be"))
    else:
        other.write_text(text, encoding, newline="\r\n")
    assert told(tx40, other) == told(tx40, plain)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("0x1A", 26),
        ("0X1a", 26),
        ("1Ah", 26),
        ("032", 26),
        ("08", 8),
        ("00", 0),
        ("-26", -26),
        ("26.0", 26),
        ("$NODEID+0x180", 0x185),
        ("0x180+$nodeid", 0x185),
        ("(NODEID + 384)", 0x185),
        ("$NODE_ID+0x80000180", 0x80000185),
        ("TRUE", 1),
        ("no", 0),
        ("", None),
        ("0.25", None),
        ("4x0", None),
        ("no value", None),
    ],
)
def test_forms_of_numbers(text: str, number: int | None) -> None:
    assert number_of(text, NODE) == number


def test_pdos_that_a_number_stands_for(tx40: Robot, tmp_path: Path) -> None:
    """CompactPDO: no section describes a PDO, DeviceInfo counts them."""
    path = without(tmp_path, "1400", "1600", "1800", "1801", "1A00", "1A01", **KNOWN)
    text = path.read_text("utf-8")
    assert any("no RPDO (1400:01)" in words for words in told(tx40, path))
    head = "[DeviceInfo]\nCompactPDO=0x17\nNrOfRXPDO=4\nNrOfTXPDO=6\n"
    path.write_text(re.sub(r"\[DeviceInfo\]\n", head, text, flags=re.IGNORECASE), "utf-8")
    file = read_device_file(path, NODE)
    assert file.objects[0x1801, 1].default == 0x280 + NODE
    assert file.objects[0x1805, 1].default == 1 << 31
    assert file.has(0x1400, 5) and file.has(0x1A05, 8) and not file.has(0x1A06, 1)
    assert [f for f in foresee(tx40, 0, file) if f.severity == "refusal"] == []


def test_an_array_that_a_number_stands_for_with_the_values_of_a_dcf(tmp_path: Path) -> None:
    path = tmp_path / "drive.dcf"
    path.write_text(
        "[1016]\nParameterName=Consumer\nObjectType=8\nDataType=7\nAccessType=rw\nCompactSubObj=3\n"
        "[1016Value]\nNrOfEntries=1\n2=0x7F0064\n",
        "ascii",
    )
    file = read_device_file(path, NODE)
    assert [file.has(0x1016, k) for k in range(5)] == [True, True, True, True, False]
    assert (file.objects[0x1016, 0].default, file.objects[0x1016, 0].bits) == (3, 8)
    assert [file.objects[0x1016, k].value for k in (1, 2, 3)] == [None, 0x7F0064, None]


def test_a_torque_with_a_point_is_no_control_signal(tx40: Robot, tmp_path: Path) -> None:
    path = without(tmp_path, x6077_DataType="8", x6077_DefaultValue="0.25", **KNOWN)
    refused = [f for f in foresee(tx40, 0, read_device_file(path, NODE)) if f.severity == "refusal"]
    assert [f.subject for f in refused] == ["6077"] and "no whole number" in refused[0].text
    assert not any("is no number" in f.text for f in read_device_file(path, NODE).findings)


@pytest.mark.parametrize(
    "section", ["DeviceInfo", "FileInfo", "DummyUsage", "MandatoryObjects", "OptionalObjects"]
)
def test_without_a_section_of_the_head(tx40: Robot, plain: Path, section: str) -> None:
    text = plain.read_text("utf-8")
    cut = re.sub(rf"(?ms)^\[{section}\]\n.*?(?=^\[|\Z)", "", text)
    assert cut != text
    before = told(tx40, plain)
    plain.write_text(cut, "utf-8")
    assert told(tx40, plain) == before
