"""In each place of a set stands the name that is the likeliest by both motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from ident.discrepancy.by_evidence import workflow
from ident.discrepancy.by_evidence.decide import likeliest as module
from ident.discrepancy.by_evidence.decide.names import NOTHING, Slot, probabilities
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.by_evidence.decide.search import Searched

ZONE, DRY, LOAD = ("command_dead_zone", (4,)), ("coulomb_friction", (4,)), ("payload", ())


@dataclass(frozen=True)
class _Set:
    members: tuple[Any, ...]

    @property
    def keys(self) -> list[Any]:
        return [one.candidate.key for one in self.members]


def of(*keys: Any) -> Any:
    return _Set(tuple(SimpleNamespace(candidate=SimpleNamespace(key=key)) for key in keys))


def stands(monkeypatch: pytest.MonkeyPatch, odds: Mapping[Any, Mapping[Any, float]]) -> list[Any]:
    """Names of a payload and a dead zone's set in the end.

    Args:
        monkeypatch: of the test.
        odds: for each name that can stand, those of all names in its place.
    """

    def slot(search: Any, searched: Searched, number: int, *_: Any) -> Slot:
        """Places are the same whatever stands in them; effects are placed."""
        key = searched.found.members[number].candidate.key
        wanted = odds.get(key, {key: 9.0})
        placed: Any = {one: "placed" for one in wanted if one[0] not in (NOTHING[0], NO_NAME)}
        return Slot(probabilities(wanted, placed))

    def with_name(search: Any, without: Any, entries: Any, key: Any) -> Any:
        return of(*without.keys, key)

    monkeypatch.setattr(module, "slot", slot)
    monkeypatch.setattr(module, "screen", lambda *_: ())
    monkeypatch.setattr(module, "with_name", with_name)
    search: Any = SimpleNamespace(
        problem=None,
        without=lambda found, number: of(*(key for k, key in enumerate(found.keys) if k != number)),
        settled=lambda found: (found, "settled"),
    )
    began: Any = Searched(of(LOAD, ZONE), of(), "as found", (), {})  # type: ignore[arg-type]
    ended: Any = module.likeliest(search, began, None)  # type: ignore[arg-type]
    assert ended.present == "settled" or ended.found.keys == [LOAD, ZONE]
    return sorted(ended.found.keys)


def test_a_name_that_other_motion_speaks_for_takes_the_place(monkeypatch: pytest.MonkeyPatch) -> None:
    likelier = {ZONE: {ZONE: 15590.8, DRY: 17011.8, NOTHING: 0.0}}
    assert stands(monkeypatch, likelier) == [DRY, LOAD]
    even = {ZONE: {ZONE: 15590.8, DRY: 15590.3, NOTHING: 0.0}}
    assert stands(monkeypatch, even) == [ZONE, LOAD]


@pytest.mark.parametrize("no_name", [NOTHING, (NO_NAME, (4,))])
def test_nothing_takes_no_place(monkeypatch: pytest.MonkeyPatch, no_name: Any) -> None:
    """What has no name is shown with the name that comes nearest, and is not confirmed."""
    assert stands(monkeypatch, {ZONE: {ZONE: 5.0, no_name: 9.0}}) == [ZONE, LOAD]


def test_names_that_change_places_for_ever_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is asked beside the set that it stands in."""
    each_other = {ZONE: {ZONE: 5.0, DRY: 9.0}, DRY: {ZONE: 9.0, DRY: 5.0}}
    assert len(stands(monkeypatch, each_other)) == 2


def test_it_is_asked_before_limits_take_the_place_of_forms(monkeypatch: pytest.MonkeyPatch) -> None:
    search, question = SimpleNamespace(problem=None), SimpleNamespace(validation=(), standstill=None)
    monkeypatch.setattr(workflow, "posed", lambda *_: None)
    monkeypatch.setattr(workflow, "searched_beside_motion", lambda *_: (search, SimpleNamespace(found=None)))
    monkeypatch.setattr(workflow, "with_found", lambda *_: None)
    monkeypatch.setattr(workflow, "where_turned", lambda *_: None)
    monkeypatch.setattr(workflow, "HeldOut", SimpleNamespace(of=lambda *_: "other motion"))
    monkeypatch.setattr(workflow, "borne_out", lambda *_: ("borne out", ()))
    monkeypatch.setattr(workflow, "likeliest", lambda *given: ("the likeliest of", *given[1:]))

    class Asked(Exception):
        """What limits are looked for in."""

    def simplified(search: Any, searched: Any, held: Any) -> None:
        raise Asked(*searched)

    monkeypatch.setattr(workflow, "simplified", simplified)
    with pytest.raises(Asked) as asked:
        workflow._answered(question, lambda step, share: None, False)  # type: ignore[arg-type]
    assert asked.value.args == ("the likeliest of", "borne out", "other motion")
