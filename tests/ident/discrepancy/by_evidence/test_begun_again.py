"""A joint that is left with more than usual is begun anew with what came next."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide.begun_again import begun_again
from ident.discrepancy.by_evidence.decide.search import MOST, Search, key_of
from ident.discrepancy.by_evidence.decide.state import Found, likelier
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.effects.family import Shape
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.toy_effects import (
    REACH,
    family,
    found_alone,
    names_of,
    problem_of,
    searching,
)

CORNER_AT = -0.04
GRID = tuple(float(at) for at in np.linspace(-0.08, 0.08, 9))
CORNER = family(
    "corner",
    lambda q, shape: np.maximum(0.0, (q - shape[0]) / REACH),
    (Shape("at", "m", GRID, -0.09, 0.09, False),),
)
CUBE = family("cube", lambda q, shape: (q / REACH) ** 3)
BOTH = [CORNER, CUBE]


def corner_and_cube(q: FloatArray) -> FloatArray:
    return np.asarray(10.0 * np.maximum(0.0, (q - CORNER_AT) / REACH) + 6.0 * (q / REACH) ** 3)


def corner_alone(q: FloatArray) -> FloatArray:
    return corner_and_cube(q) - 6.0 * (q / REACH) ** 3


def with_one(hidden: Callable[[FloatArray], FloatArray]) -> tuple[Search, Found, tuple[Entry, ...]]:
    """A search that took a corner and looks no further, and its vocabulary."""
    search = searching(problem_of(hidden), BOTH)
    searched = found_alone(search, CORNER)
    return search, searched.found, searched.entries


def test_two_effects_are_found_that_are_neither_of_them_likeliest_alone() -> None:
    search, found, entries = with_one(corner_and_cube)
    again = likelier(begun_again(search, found, entries, MOST), found)
    assert again is not None
    assert {name for name, _ in key_of(again)} == {"corner", "cube"}
    assert again.log_posterior > found.log_posterior + 10.0


def test_nothing_is_begun_where_no_more_is_left_than_usual() -> None:
    search, found, entries = with_one(corner_alone)
    assert begun_again(search, found, entries, MOST) == []


def test_no_set_has_more_effects_than_a_set_may() -> None:
    search, found, entries = with_one(corner_and_cube)
    assert begun_again(search, found, entries, 1) == []


def test_a_search_that_finds_nothing_more_begins_again(monkeypatch: pytest.MonkeyPatch) -> None:
    search, found, _ = with_one(corner_and_cube)
    monkeypatch.setattr(Search, "_swapped", lambda *asked: None)
    monkeypatch.setattr(Search, "_extended", lambda _, beside, *asked: None if beside.members else found)
    assert names_of(search.run()) == ["corner", "cube"]
