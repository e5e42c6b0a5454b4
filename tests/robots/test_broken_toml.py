"""A broken robot.toml gives one line: file, line, key, value, what is allowed."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

import robots
from robots import RobotFileError
from tests.robots.conftest import RobotFolder


@dataclasses.dataclass(frozen=True)
class Break:
    """Replace an occurrence of ``old`` by ``new``; the rest is what the message must hold."""

    old: str | re.Pattern[str]
    new: str
    key: str
    value: str
    allowed: str
    occurrence: int = 1
    line_offset: int = 0


VALUES = [
    Break(
        "node_id = 2", "node_id = 200", "drive[2].node_id", "200 is too large", "a whole number from 1 to 127"
    ),
    Break("node_id = 2", "node_id = 0", "drive[2].node_id", "0 is too small", "a whole number from 1 to 127"),
    Break("node_id = 2", 'node_id = "two"', "drive[2].node_id", '"two" is not a whole', "from 1 to 127"),
    Break("node_id = 2", "node_id = 2.0", "drive[2].node_id", "2.0 is not a whole number", "from 1 to 127"),
    Break("node_id = 2", "node_id = true", "drive[2].node_id", "true is not a whole number", "from 1 to 127"),
    Break(
        "node_id = 5", "node_id = 2", "drive[5].node_id", "2 is already the node_id of drive[2]", "its own"
    ),
    Break(
        "gear = 48.0", 'gear = "48"', "drive[4].gear", '"48" is not a number', "a number from 0.001 to 100000"
    ),
    Break(
        "gear = 48.0", "gear = true", "drive[4].gear", "true is not a number", "a number from 0.001 to 100000"
    ),
    Break("gear = 48.0", "gear = -48.0", "drive[4].gear", "-48.0 is too small", "from 0.001 to"),
    Break("gear = 48.0", "gear = nan", "drive[4].gear", "nan is not a finite number", "from 0.001 to"),
    Break("gear = 48.0", "gear = inf", "drive[4].gear", "inf is not a finite number", "from 0.001 to"),
    Break("gear = 48.0", "gear = 2001-01-01", "drive[4].gear", "2001-01-01 is not a number", "from 0.001 to"),
    *(
        Break(
            'name = "joint_1"', f'name = "{name}"', "joint[1].name", "cannot head a column", "none of = + - @"
        )
        for name in ("=HYPERLINK(1)", "+1", "-1", "@SUM(1)", "a,=1", "a;=1", "a\\t=1")
    ),
    Break("sign = -1", "sign = -2", "drive[4].sign", "-2 is not one of", "-1 or 1"),
    Break("sign = -1", "sign = true", "drive[4].sign", "true is not one of", "-1 or 1"),
    Break("sign = -1", "sign = -1.0", "drive[4].sign", "-1.0 is not one of", "-1 or 1"),
    Break("format = 1", "format = 2", "format", "2 is not one of", "1"),
    Break('name = "tx40"', 'name = "TX 40"', "name", '"TX 40" is not spelled', "like ^[a-z][a-z0-9_-]*$"),
    Break(
        'type = "cascade_p_pi"',
        'type = "cascade"',
        "controller.type",
        '"cascade" is not one of',
        '"cascade_p_pi", "pd" or "pid"',
    ),
    Break("offset = true", "offset = 1", "identification.offset", "1 is neither true nor", "true or false"),
    Break(
        "index = 0x6077",
        "index = 0x60770",
        "drive[3].control_signal.index",
        "395120 is too large",
        "a whole number from 4096 to 65535",
        occurrence=3,
    ),
    Break(
        "dynamics = { inertia = 0.0341",
        "dynamics = { inertia = -1",
        "drive[4].dynamics.inertia",
        "-1 is too small",
        "a number from 0 to 100000",
    ),
    Break(
        "position = [-2.0943, 2.33]",
        "position = [\n  -2.0943,\n  'high',\n]",
        "joint[5].position[2]",
        '"high" is not a number',
        "a number",
        line_offset=2,
    ),
    Break(
        "position = [-2.0943, 2.33]",
        "position = [1, 1]",
        "joint[5].position",
        "[1, 1] is not in",
        "lower < upper",
    ),
    Break(
        "position = [-2.0943, 2.33]",
        "position = [1, 2, 3]",
        "joint[5].position",
        "[1, 2, 3] has too many",
        "[a",
    ),
    Break("position = [-2.0943, 2.33]", "position = [1]", "joint[5].position[2]", "missing from", "a number"),
    Break(
        "position = [-2.0943, 2.33]",
        "position = 2.33",
        "joint[5].position",
        "2.33 is not a list",
        "[a number from -100 to 100, a",
    ),
    Break("home = [0.0, ", "home = [9, ", "home[1]", "9 is outside", "-3.1415 to 3.1415"),
    Break("home = [0.0, ", "home = [", "home", "has 5 of 6 entries", "6 entries, one per joint"),
    Break(
        "    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0],",
        "    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],",
        "transmission",
        "cannot be inverted",
        "an invertible matrix",
        line_offset=-6,
    ),
    Break(
        "    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0],",
        "    [0.0, 0.0, 1.0, 1.0],",
        "transmission[6]",
        "[0.0, 0.0, 1.0, 1.0] has 4 of 6 entries",
        "6 entries",
    ),
    Break(
        "    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0],",
        "    [0.0, 0.0, 0.0, 0.0, 1.0, 1e300],",
        "transmission[6][6]",
        "1e+300 is too large",
        "a number from -1000 to 1000",
    ),
    Break(
        re.compile(r"saturation = \[\S+"),
        "saturation = [",
        "controller.saturation",
        "has 5 of 6 entries",
        "6 entries, one per joint",
    ),
    Break(
        "offset = true",
        "offset = [true, false]",
        "identification.offset",
        "has 2 of 6 entries",
        "6 entries, one per joint",
    ),
    Break(
        'type = "cascade_p_pi"',
        'type = "pd"',
        "controller.integral_gain",
        "does not go with type",
        "0 for each drive",
        line_offset=4,
    ),
    Break(
        re.compile(r"friction_width = \S+"),
        "friction_width = 0",
        "identification.friction_width",
        "0 does not go with friction_sign",
        "greater than 0",
    ),
    Break(
        re.compile(r"sample_time = \S+"),
        "sample_time = 0.003",
        "controller.sample_time",
        "0.003 does not divide the cycle time of 0.004 s",
        "bus.cycle_time / 1, 2, 3",
    ),
    Break(
        re.compile(r"sample_time = \S+"),
        "sample_time = 1e-308",
        "controller.sample_time",
        "1e-308 is too small",
        "a number from 1e-06 to 0.1",
    ),
    Break(
        "encoder_counts = 65536\ngear = 48.0",
        "encoder_counts = 65536\ngear = 1e308",
        "drive[4].gear",
        "1e+308 is too large",
        "a number from 0.001 to 100000",
        line_offset=1,
    ),
    Break(
        "encoder_counts = 65536\ngear = 48.0",
        "encoder_counts = 65536\ngear = 1e-308",
        "drive[4].gear",
        "1e-308 is too small",
        "a number from 0.001 to 100000",
        line_offset=1,
    ),
    Break(
        "per_count = 0.0005",
        "per_count = 0.0001",
        "drive[4].control_signal.per_count",
        "0.0001 lets 16 bits reach 3.277 only",
        "at least 0.000155",
        occurrence=4,
    ),
    Break(
        "encoder_counts = 65536",
        "encoder_counts = 2000000000",
        "drive[3].encoder_counts",
        "2000000000 makes 3.45e+10 counts",
        "1000 to 2147483647 counts there",
    ),
    Break(
        'name = "joint_6"', 'name = "joint_5"', "joint[6].name", '"joint_5" is already the name', "of its own"
    ),
]

KEYS = [
    Break(
        "gear = 48.0", "geer = 48.0", "drive[4].geer", 'did you mean "gear"', "node_id, encoder_counts, gear"
    ),
    Break(
        "[controller]", "[contoller]", "contoller", 'did you mean "controller"', "format, name, description"
    ),
    Break(
        "format = 1",
        'format = 1\nsource_text = "x"',
        "source_text",
        "does not exist",
        "format",
        line_offset=1,
    ),
    Break(
        "format = 1", 'format = 1\nfolder = "/"', "folder", "does not exist", "format, name", line_offset=1
    ),
    Break(
        "subindex = 0, per_count",
        "subindx = 0, per_count",
        "drive[1].control_signal.subindx",
        'did you mean "subindex"',
        "index, subindex, per_count, sign",
    ),
    # The missing key's line is the header of the table that should hold it.
    Break("gear = 48.0\n", "", "drive[4].gear", "missing from drive[4]", "from 0.001 to", line_offset=-3),
    Break(
        re.compile(r"sample_time = \S+\n"),
        "",
        "controller.sample_time",
        "missing from controller",
        "a number",
        line_offset=-2,
    ),
    Break('urdf = "tx40.urdf"\n', "", "urdf", "missing", "a text", line_offset=-6),
]


@pytest.mark.parametrize("case", VALUES + KEYS, ids=lambda case: f"{case.key}: {case.value}")
def test_message_names_file_line_key_value_and_allowed(folder: RobotFolder, case: Break) -> None:
    line = folder.edit(folder.toml, case.old, case.new, case.occurrence) + case.line_offset
    with pytest.raises(RobotFileError) as caught:
        robots.load(folder.path)
    message = str(caught.value)
    assert message.startswith(f"{folder.toml}:{line}: {case.key}: "), message
    problem, _, allowed = message.removeprefix(f"{folder.toml}:{line}: {case.key}: ").partition("; allowed: ")
    assert case.value in problem
    assert case.allowed in allowed
    assert "\n" not in message


def test_other_errors_are_counted(folder: RobotFolder) -> None:
    folder.edit(folder.toml, "gear = 45.0", "gear = 0", occurrence=2)
    line = folder.edit(folder.toml, "gear = 45.0", "gear = 0")
    folder.edit(folder.toml, re.compile(r"cutoff_hz = \S+"), "cutoff_hz = -40")
    with pytest.raises(RobotFileError, match=r"drive\[3\]\.gear: 0 is too small \(and 2 more\)") as caught:
        robots.load(folder.path)
    assert caught.value.line == line


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("gear = 48.0", "gear = ", "Invalid value"),
        ("gear = 48.0", "gear 48.0", "Expected '=' after a key"),
        ("sign = -1", "gear = 3", "Cannot overwrite a value"),
        ('name = "joint_4"', 'name = "joint_4', "Illegal character"),
    ],
)
def test_syntax_errors_give_their_line(folder: RobotFolder, old: str, new: str, problem: str) -> None:
    line = folder.edit(folder.toml, old, new)
    with pytest.raises(RobotFileError) as caught:
        robots.load(folder.path)
    assert str(caught.value).startswith(f"{folder.toml}:{line}: not TOML: {problem}")


def test_text_that_ends_in_the_middle(folder: RobotFolder) -> None:
    text = folder.toml.read_text("utf-8")
    text = text[: text.index("transmission = [") + len("transmission = [")]
    folder.toml.write_text(text, "utf-8")
    with pytest.raises(RobotFileError) as caught:
        robots.load(folder.path)
    assert caught.value.line == text.count("\n") + 1


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b'format = 1\nname = "\xff"\n', ":2: byte 0xff is not UTF-8 text"),
        (b"\x89MCAP0\r\n\x00\x01", ":1: byte 0x89 is not UTF-8 text"),
        (b"#" * 1_000_001, ": larger than 1000000 bytes"),
        (b"", ":1: format: missing (and 5 more)"),
        (b"x = " + b"[" * 5000, ": not TOML: lists nested too deeply"),
        (b"format = " + b"9" * 5000, ": not TOML: Exceeds the limit"),
        (b"format = 0x" + b"f" * 9000, ":1: format: 0xffff"),
    ],
    ids=["latin-1", "a capture", "too large", "empty", "deep", "long number", "long hexadecimal number"],
)
def test_files_that_are_no_robot(tmp_path: Path, content: bytes, problem: str) -> None:
    file = tmp_path / "robot.toml"
    file.write_bytes(content)
    with pytest.raises(RobotFileError) as caught:
        robots.load(file)
    assert str(caught.value).startswith(f"{file}{problem}")
    assert len(str(caught.value).splitlines()) == 1


def test_unknown_name_lists_the_shipped_arms() -> None:
    with pytest.raises(RobotFileError) as caught:
        robots.load("tx4O")
    message = str(caught.value)
    assert message.startswith('tx4O: no robot of this name, no such file (did you mean "tx40"?)')
    assert "allowed: emps, tx40, " in message


def test_paths_that_are_no_robot_file(tmp_path: Path) -> None:
    for path, problem in [
        (tmp_path, "a folder without robot.toml"),
        (tmp_path / "none.toml", "no such file"),
        (Path("/dev/null"), "not a file"),
        (Path("a" * 5000), "cannot be read: File name too long"),
        (Path("nul\0byte"), "no such file"),
    ]:
        with pytest.raises(RobotFileError, match=problem):
            robots.load(path)


def test_unreadable_file(folder: RobotFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_arguments: object, **_options: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(RobotFileError) as caught:
        robots.load(folder.path)
    assert str(caught.value) == f"{folder.toml}: cannot be read: Permission denied"
