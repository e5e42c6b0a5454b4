"""Every place of a TOML text is found at its line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

import robots
from robots.toml_lines import TomlLines, key_text

TEXT = '''\
# a comment with [brackets] = and "quotes
title = "x # not a comment [[no]]"
"quoted key".inner = 3

[[drive]] # first
node_id = 1
signal = { index = 2, "odd.key" = [1, 2] }
[drive.dynamics]
inertia = 1

[[ drive ]]
node_id = 2
matrix = [
    [1, 2], # one
    # nothing

    [3,
     4],
]
text = """
node_id = 99
""\\" still text
"""
[[drive.filter]]
[[drive.filter]]
cutoff = 3
[late.table]
key = \'\'\'
[[drive]]\'\'\'
[late]
other = 1
'''


def test_lines_of_all_forms() -> None:
    tomllib.loads(TEXT)
    lines = TomlLines(TEXT)
    expected = {
        ("title",): 2,
        ("quoted key",): 3,
        ("quoted key", "inner"): 3,
        ("drive",): 5,
        ("drive", 0): 5,
        ("drive", 0, "node_id"): 6,
        ("drive", 0, "signal", "index"): 7,
        ("drive", 0, "signal", "odd.key", 1): 7,
        ("drive", 0, "dynamics"): 8,
        ("drive", 0, "dynamics", "inertia"): 9,
        ("drive", 1): 11,
        ("drive", 1, "node_id"): 12,
        ("drive", 1, "matrix"): 13,
        ("drive", 1, "matrix", 0, 1): 14,
        ("drive", 1, "matrix", 1): 17,
        ("drive", 1, "matrix", 1, 1): 18,
        ("drive", 1, "text"): 20,
        ("drive", 1, "filter", 0): 24,
        ("drive", 1, "filter", 1): 25,
        ("drive", 1, "filter", 1, "cutoff"): 26,
        ("late", "table", "key"): 28,
        ("late",): 30,
        ("late", "other"): 31,
    }
    assert {path: lines.line_of(path) for path in expected} == expected


def test_a_place_that_is_not_written_falls_back_to_what_encloses_it() -> None:
    lines = TomlLines(TEXT)
    assert lines.line_of(("drive", 1, "gear")) == 11
    assert lines.line_of(("drive", 0, "signal", "per_count")) == 7
    assert lines.line_of(("controller", "gain")) == 1


def test_windows_line_ends() -> None:
    assert TomlLines("a = 1\r\n\r\n[b]\r\nc = 2\r\n").line_of(("b", "c")) == 4


def test_key_text_counts_from_one() -> None:
    assert key_text(("drive", 2, "signal", "list", 0, 1)) == "drive[3].signal.list[1][2]"


scalars = st.one_of(st.integers(0, 99), st.booleans(), st.text(alphabet="ab #[]{}=,.\"\\'\n", max_size=8))
values = st.recursive(scalars, lambda inner: st.lists(inner, max_size=3), max_leaves=8)
tables = st.dictionaries(st.text(alphabet="ab.# ]", max_size=3), values, max_size=4)


def written(value: Any, newline: bool) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, list):
        separator = ",\n  " if newline else ", "
        return "[" + separator.join(written(entry, newline) for entry in value) + "]"
    if newline and "'''" not in value and not value.endswith("'") and value:
        return f"'''\n{value}'''"
    return quoted(value)


def quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


@given(st.lists(tables, min_size=1, max_size=4), st.booleans())
def test_any_text_that_tomllib_reads(entries: list[dict[str, Any]], newline: bool) -> None:
    """A written file knows where its own keys went; the scanner must find the same lines."""
    text, expected = "", {}
    for i, entry in enumerate(entries):
        text += "# [[entry]]\n[[entry]]\n"
        expected[("entry", i)] = text.count("\n")
        for key, value in entry.items():
            expected[("entry", i, key)] = text.count("\n") + 1
            text += f"{quoted(key)} = {written(value, newline)} # ]\n"
    assert tomllib.loads(text) == {"entry": entries}
    lines = TomlLines(text)
    assert {path: lines.line_of(path) for path in expected} == expected


def test_every_key_of_the_shipped_files_is_found_on_a_line_that_holds_it() -> None:
    for name in robots.shipped():
        file = Path(robots.__file__).parent / name / "robot.toml"
        text = file.read_text("utf-8")
        rows = text.split("\n")
        lines = TomlLines(text)

        def check(value: Any, path: tuple[str | int, ...]) -> None:
            row = rows[lines.line_of(path) - 1]  # noqa: B023
            if isinstance(value, dict):
                for key, entry in value.items():
                    check(entry, (*path, key))
            elif isinstance(value, list):
                for i, entry in enumerate(value):
                    check(entry, (*path, i))
            else:
                key = next(part for part in reversed(path) if isinstance(part, str))
                assert key in row or row.startswith("    ["), (path, row)

        check(tomllib.loads(text), ())
