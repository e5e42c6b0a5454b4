"""What is no further effect at a reversal beside what the moving arm has shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pytest

from ident.discrepancy.accepted import joints_not_told
from ident.discrepancy.results import Candidate
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import search

FRICTION = [family_named(name) for name in ("stribeck_friction", "static_friction", "hysteresis")]


@dataclass(frozen=True)
class Placed:
    place: Place


@dataclass(frozen=True)
class Found:
    """As much of a finding as is asked for."""

    effect: str
    joints: tuple[int, ...]
    indistinguishable_from: tuple[Candidate, ...] = ()

    @property
    def placed(self) -> Placed:
        return Placed(Place("drive", tuple(joint - 1 for joint in self.joints)))


def test_joints_of_every_name_in_a_set_are_not_told() -> None:
    placed: Any = None
    rival = Candidate("wrist_coupling", (5, 6), 1000.0, 0.3, placed)
    found = [Found("current_loop_lag", (6,), (rival,)), Found("hysteresis", (3,)), Found("payload", ())]
    assert joints_not_told(found) == {4, 5}  # type: ignore[arg-type]


@pytest.mark.slow
def test_friction_that_falls_with_speed_is_alone_on_its_drive() -> None:
    rising = {"drive": 1, "rise": 0.52, "speed": 0.144}
    found = search("tx40", 4242, {"stribeck_friction": [rising]}, duration=8.0, vocabulary=FRICTION)
    assert [(one.effect, one.joints) for one in found.findings] == [("stribeck_friction", (1,))]


@pytest.mark.slow
def test_friction_that_no_moving_row_shows_is_not_called_clean() -> None:
    rising = {"drive": 2, "rise": 1.76, "speed": 0.04}
    found = search("tx40", 4242, {"stribeck_friction": [rising]}, duration=8.0, vocabulary=FRICTION)
    assert [(one.effect, one.joints) for one in found.findings] == [("stribeck_friction", (2,))]
    without = [family_named("base_tilt")]
    unnamed = search("tx40", 4242, {"stribeck_friction": [rising]}, duration=8.0, vocabulary=without)
    assert unnamed.verdict == "unnamed"
    assert "at its reversals, least of all at joint 2" in unnamed.description
