"""Names in messages: all of a few, of many as many as fit, and how many more there are."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.listing import in_lines, listed, short

WIDEST = 80
"""A line of a terminal; a message has two, beside its own words and a path."""
NAMES = st.lists(st.text("abc_/", min_size=1, max_size=200), min_size=1, max_size=50)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["q1", "q2"], "q1, q2"),
        ([f"joint_{k}" for k in range(1, 7)], "joint_1, joint_2, joint_3, joint_4, joint_5, joint_6"),
        ([f"joint_{k}" for k in range(1, 8)], "joint_1, joint_2, joint_3 and 4 more"),
        (["a" * 30, "b" * 30, "c" * 30], f"{'a' * 30}, {'b' * 30} and 1 more"),
        (["a" * 40, "b" * 40], f"{'a' * 40} and 1 more"),
    ],
)
def test_what_fits_is_listed(names: list[str], said: str) -> None:
    assert listed(names) == said


@given(NAMES, st.integers(1, 20))
def test_a_list_is_never_wider_than_a_line(names: list[str], few: int) -> None:
    assert len(listed(names, few)) <= WIDEST


@given(NAMES)
def test_lines_have_all_names_and_are_never_wider(names: list[str]) -> None:
    lines = in_lines(names)
    assert ", ".join(lines).split(", ") == [short(name) for name in names]
    assert all(len(line) <= WIDEST for line in lines)
