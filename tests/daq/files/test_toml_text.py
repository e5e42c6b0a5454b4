"""TOML that is written is what Python's own reader reads."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.files.toml_text import TomlTextError, toml_text

WORDS = st.text(st.characters(codec="utf-8"), max_size=12)
WHOLE = st.integers(-(2**63), 2**63 - 1)
SCALARS = WORDS | WHOLE | st.booleans() | st.floats(allow_nan=False)
LISTS = st.lists(SCALARS, max_size=4)
INNER = st.dictionaries(WORDS, SCALARS | LISTS, max_size=3)
TABLES = st.dictionaries(WORDS, SCALARS | LISTS | st.dictionaries(WORDS, SCALARS | LISTS | INNER, max_size=3))


@given(TABLES, st.lists(INNER, max_size=3))
@settings(max_examples=100, deadline=None)
def test_what_is_written_is_read_back_to_the_last_bit(table: dict[str, Any], entries: list[Any]) -> None:
    whole = table | {"entries": entries}
    assert repr(tomllib.loads(toml_text(whole))) == repr(_in_order(whole))


def _in_order(table: dict[str, Any]) -> dict[str, Any]:
    """Plain values come first: what follows the head of a table is its own."""
    nested = {key for key, value in table.items() if _is_nested(value)}
    plain = {key: value for key, value in table.items() if key not in nested}
    return plain | {key: table[key] for key in table if key in nested}


def _is_nested(value: Any) -> bool:
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(entry, dict) for entry in value)
    )


def test_what_is_none_is_left_out() -> None:
    assert tomllib.loads(toml_text({"a": None, "b": {"c": None, "d": 1}})) == {"b": {"d": 1}}


@pytest.mark.parametrize("value", [{1, 2}, b"bytes", 1j, object()])
def test_what_toml_has_no_form_for_is_refused(value: object) -> None:
    with pytest.raises(TomlTextError):
        toml_text({"key": value})
