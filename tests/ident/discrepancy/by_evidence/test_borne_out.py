"""A set loses what other motion is predicted better without."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy.by_evidence.confirm import borne_out as module
from ident.discrepancy.by_evidence.confirm.borne_out import borne_out
from ident.discrepancy.by_evidence.decide.search import Searched
from ident.effects.usual import SYMBOLS

PROBLEM = SimpleNamespace(
    present=SimpleNamespace(has=lambda symbols, drive: False), uncoupled=frozenset[int]()
)
"""A model that lacks all usual terms."""


@dataclass(frozen=True)
class _Set:
    """Members by their letters."""

    members: tuple[Any, ...]
    nats: float

    @property
    def log_posterior(self) -> float:
        return self.nats * len(self.members)

    @property
    def level(self) -> Any:
        return SimpleNamespace(excess=np.ones(1))

    @property
    def letters(self) -> str:
        return "".join(one.name for one in self.members)


ON_TOP_OF: dict[str, tuple[str, ...]] = {}
"""Members that need another one, in a model without it."""


def member(name: str) -> Any:
    placed = SimpleNamespace(name=name, place=SimpleNamespace(joints=(0,)))
    candidate = SimpleNamespace(
        key=(name, (0,)), place=placed.place, family=SimpleNamespace(on_top_of=ON_TOP_OF.get(name, ()))
    )
    return SimpleNamespace(
        name=name,
        entry=SimpleNamespace(placed=placed, white=SimpleNamespace(at=(0,)), candidate=candidate),
        joints=(0,),
        candidate=candidate,
    )


def kept(
    monkeypatch: pytest.MonkeyPatch, letters: str, scores: Mapping[str, float], fitted: float = 1.0
) -> tuple[str, Sequence[tuple[str, float]]]:
    """What stays of a set, and what goes with its nats; a part that is not listed predicts like nothing.

    Of the rows that were fitted each member has so many nats.
    """
    monkeypatch.setattr(module, "part_of", lambda problem, found, members: _Set(tuple(members), fitted))

    def without(found: _Set, number: int) -> Any:
        """The first in the alphabet is what the rows speak for most clearly."""
        return SimpleNamespace(log_posterior=ord(found.members[number].name))

    search: Any = SimpleNamespace(problem=PROBLEM, settled=lambda found: (found, "settled"), without=without)
    held: Any = SimpleNamespace(score=lambda found, excess: scores.get(found.letters, 0.0))
    whole: Any = _Set(tuple(member(name) for name in letters), fitted)
    searched = Searched(whole, _Set((), fitted), None, (), {})  # type: ignore[arg-type]
    found, refuted = borne_out(search, searched, held)
    assert (found.present == "settled") is bool(refuted)
    return found.found.letters, [(one.member.name, one.nats) for one in refuted]  # type: ignore[attr-defined]


def test_what_other_motion_is_predicted_better_without_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    scores = {"a": 50.0, "b": -20.0, "ab": 30.0}
    assert kept(monkeypatch, "ab", scores) == ("a", [("b", 20.0)])


def test_two_that_hold_each_other_up_go_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without either alone the other motion is predicted worse than with both."""
    scores = {"a": 50.0, "abc": 30.0, "ab": 10.0, "ac": 10.0, "bc": -20.0}
    assert kept(monkeypatch, "abc", scores) == ("a", [("b", 40.0), ("c", 40.0)])


def test_what_other_motion_bears_out_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    assert kept(monkeypatch, "ab", {"a": 50.0, "b": 10.0, "ab": 60.0}) == ("ab", [])


def test_what_the_rows_speak_for_most_clearly_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ripple whose period is a little off is refuted elsewhere; the delay beside it is no better a name."""
    scores = {"a": -500.0, "b": 20.0, "ba": -400.0, "c": 30.0, "bac": -450.0, "ac": -600.0, "bc": 40.0}
    assert kept(monkeypatch, "bac", scores) == ("ba", [("c", 50.0)])


def test_what_the_fitted_rows_say_more_clearly_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    scores = {"a": 50.0, "b": -20.0, "ab": 30.0}
    assert kept(monkeypatch, "ab", scores, fitted=9.0) == ("a", [("b", 20.0)])
    assert kept(monkeypatch, "ab", scores, fitted=11.0) == ("ab", [])


def test_one_alone_is_not_taken_away(monkeypatch: pytest.MonkeyPatch) -> None:
    assert kept(monkeypatch, "a", {"a": -5.0}) == ("a", [])


def test_what_is_on_top_of_another_is_in_no_part_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without dry friction the fall of it would be likelier."""
    monkeypatch.setitem(ON_TOP_OF, "c", ("b",))
    monkeypatch.setitem(SYMBOLS, "b", ("B",))
    scores = {"a": 0.0, "ab": 10.0, "abc": 20.0, "ac": 50.0}
    assert kept(monkeypatch, "abc", scores) == ("abc", [])
    monkeypatch.delitem(ON_TOP_OF, "c")
    assert kept(monkeypatch, "abc", scores) == ("ac", [("b", 30.0)])
