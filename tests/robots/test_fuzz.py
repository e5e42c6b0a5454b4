"""Whatever happens to a robot.toml: either a valid Robot, or one RobotFileError of one line."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

import robots
from robots import Robot, RobotFileError

FILE = Path(robots.__file__).parent / "tx40" / "robot.toml"
# Comments only dilute the corruption.
TEXT = "\n".join(row for row in FILE.read_text("utf-8").split("\n") if not row.startswith("#"))
WORDS = "1 -1 0 1e400 nan true 1979-05-27 [ ] { } [[drive]] [bus] [[]] = . , gear name # \" ''' \\ é"
TOKENS = st.sampled_from([*WORDS.split(" "), "\n", "\0", "\ufeff", "0x7fffffffffffffffff"])
PIECES = st.tuples(st.integers(0, len(TEXT)), st.integers(0, 30), TOKENS | st.text(max_size=4))


def check(text: str) -> None:
    try:
        robot = robots.robot_from_text(text, FILE)
    except RobotFileError as error:
        message = str(error)
        assert message.startswith(f"{FILE.parent}/")
        assert len(message.splitlines()) == 1
    else:
        assert isinstance(robot, Robot)
        assert robot.source_text == text


@settings(max_examples=300)
@given(st.lists(PIECES, min_size=1, max_size=3))
def test_replaced_pieces(pieces: list[tuple[int, int, str]]) -> None:
    text = TEXT
    for start, length, token in pieces:
        text = text[:start] + token + text[start + length :]
    check(text)


@settings(max_examples=150)
@given(st.data())
def test_replaced_values(data: st.DataObject) -> None:
    """Structure kept, one value replaced by any other: the checks behind the syntax."""
    rows = TEXT.split("\n")
    assignments = [i for i, row in enumerate(rows) if " = " in row and not row.endswith("[")]
    i = data.draw(st.sampled_from(assignments))
    key = rows[i].partition(" = ")[0]
    numbers = st.integers(-(2**70), 2**70) | st.floats()
    value = data.draw(
        numbers | st.lists(numbers, max_size=7) | st.sampled_from(['"x"', "true", "{ a = 1 }", "[[1]]"])
    )
    rows[i] = f"{key} = {value}"
    check("\n".join(rows))


@settings(max_examples=150)
@given(st.data())
def test_dropped_and_swapped_rows(data: st.DataObject) -> None:
    rows = TEXT.split("\n")
    places = st.integers(0, len(rows) - 1)
    for place in data.draw(st.lists(places, max_size=3)):
        rows[place] = ""
    first, second = data.draw(places), data.draw(places)
    rows[first], rows[second] = rows[second], rows[first]
    check("\n".join(rows))
