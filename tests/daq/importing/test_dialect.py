"""Text tables of any usual kind say the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from daq.importing.columns import read_table
from daq.recording.errors import CaptureError

ROWS = [[0.0, 0.5, -1.25], [0.01, 0.6, 2e-3]]


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (b"t,q1,v1\n0,0.5,-1.25\n0.01,0.6,2e-3\n", ["t", "q1", "v1"]),
        (b"t;q1;v1\r\n0;0.5;-1.25\r\n0.01;0.6;2e-3\r\n", ["t", "q1", "v1"]),
        (b"t;q1;v1\n0,0;0,5;-1,25\n0,01;0,6;2e-3\n", ["t", "q1", "v1"]),
        (b"t\tq1\tv1\n0\t0.5\t-1.25\n0.01\t0.6\t2e-3\n", ["t", "q1", "v1"]),
        (b"t q1 v1\n0 0.5 -1.25\n0.01  0.6 2e-3\n", ["t", "q1", "v1"]),
        (b"t,q1,v1\ns,rad,V\n0,0.5,-1.25\n0.01,0.6,2e-3\n", ["t", "q1", "v1"]),
        (b"0,0.5,-1.25\n0.01,0.6,2e-3\n", ["c1", "c2", "c3"]),
        (b"# made by hand\n# t q1 v1\n0 0.5 -1.25\n0.01 0.6 2e-3\n", ["t", "q1", "v1"]),
        ("t,q\u00b0,v1\n0,0.5,-1.25\n0.01,0.6,2e-3\n".encode("cp1252"), ["t", "q\u00b0", "v1"]),
        ("t,q1,v1\n0,0.5,-1.25\n0.01,0.6,2e-3\n".encode("utf-16"), ["t", "q1", "v1"]),
        (b"t|q1|v1\n0|0.5|-1.25\n0.01|0.6|2e-3\n", ["t", "q1", "v1"]),
        (b't,q\n0,"[0.5, -1.25]"\n0.01,"[0.6, 2e-3]"\n', ["t", "q:1", "q:2"]),
        (b"t,q1,v1\n[s],[-],[V]\n0,0.5,-1.25\n0.01,0.6,2e-3\n", ["t", "q1", "v1"]),
        (b"q[0];q\n0;[0.5 -1.25]\n0.01;[ 0.6\n  2e-3]\n", ["q[0]", "q:1", "q:2"]),
    ],
    ids=[
        "comma",
        "semicolon",
        "decimal comma",
        "tab",
        "spaces",
        "units",
        "no header",
        "comments",
        "cp1252",
        "utf-16",
        "bars",
        "lists",
        "units in brackets",
        "NumPy's lists",
    ],
)
def test_the_same_numbers_in_any_dress(tmp_path: Path, content: bytes, names: list[str]) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    table = read_table(path)
    assert list(table.columns) == names
    assert np.array_equal(table.pick(names), ROWS)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            b"t,frame,q1,v1\n0,base,0.5,-1.25\n0.01,base,0.6,2e-3\n",
            "log.csv: columns of text are left out: frame",
        ),
        (
            b'%t,q1,frame,v1\n0,0.5,"a,b",-1.25\n0.01,0.6,,2e-3\n',
            "log.csv: columns of text are left out: frame",
        ),
        (b"t,q1,v1,\n0,0.5,-1.25,\n0.01,0.6,2e-3,\n", ""),
    ],
    ids=["names of frames", "quoted, under a comment as ROS writes it", "a mark at the end"],
)
def test_columns_of_text_are_left_out(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(content)
    table = read_table(path)
    assert list(table.columns) == ["t", "q1", "v1"]
    assert np.array_equal(table.pick(["t", "q1", "v1"]), ROWS)
    assert table.words == ((said,) if said else ())


def test_true_and_false_are_numbers(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,valid\n0,True\n1,False\n2,true\n", encoding="utf-8")
    assert read_table(path).columns["valid"].tolist() == [1.0, 0.0, 1.0]


@pytest.mark.parametrize("rows", ["0,1\n1,broken\n", "0,1\n1,\n", "a,b\nc,d\ne,f\n"])
def test_a_word_among_numbers_is_refused(tmp_path: Path, rows: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"t,q\n{rows}", encoding="utf-8")
    with pytest.raises(CaptureError, match="is not a table of numbers"):
        read_table(path)


def test_a_binary_file_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"\x89MCAP0\r\n\x00\x01\xff")
    with pytest.raises(CaptureError, match="is not a text file"):
        read_table(path)
