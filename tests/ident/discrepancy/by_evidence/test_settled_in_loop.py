"""A rival that differs at reversals takes a finding's place where rows and closed loop together say so."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

import robots
from ident.discrepancy.by_evidence import diagnosis
from ident.discrepancy.by_evidence.decide.names import Named
from ident.discrepancy.confirmation import Shown
from ident.discrepancy.course import Course
from ident.discrepancy.validation import Validation
from ident.discrepancy.workflow import Search
from ident.effects.family import Place, PlacedEffect


class Taken:
    """A course that has taken what it was given."""

    step: Any = None

    def take(self, components: list[Any], bases: list[Any]) -> None:
        self.components = components


@pytest.mark.parametrize(
    ("rows", "shown", "takes"),
    [
        (70.0, Shown(0.906, 0.081), True),
        (2995.0, Shown(0.906, 0.081), False),
        (60.0, Shown(0.45, 0.01), False),
        (70.0, None, False),
    ],
)
def test_the_moving_rows_are_weighed_with_the_loop(
    monkeypatch: pytest.MonkeyPatch, rows: float, shown: Shown | None, takes: bool
) -> None:
    course = Taken()
    monkeypatch.setattr(Course, "begun", lambda *_: course)
    loop = SimpleNamespace(loop_run=lambda step: None, shown_in_loop=lambda *_: shown)
    monkeypatch.setattr(diagnosis, "replace", lambda basis, **_: basis)
    monkeypatch.setattr(diagnosis, "_component", lambda *_: "the rival")
    before = SimpleNamespace(first=SimpleNamespace(examination=SimpleNamespace(whitening=None)))
    step = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=robots.load("emps"))))
    finding = SimpleNamespace(component="drifting friction", basis="basis", effect="drifting_friction")
    search = SimpleNamespace(step=step, findings=[finding], prepared=None, course=before)
    search._validation = lambda prepared: loop
    placed = cast(PlacedEffect, SimpleNamespace(place=Place("drive", (0,))))
    rival = Named("hysteresis", (1,), 0.0, log_odds=66.0, placed=placed)
    diagnosis._Led._settle_in_loop(cast(Any, search), 0, rival, rows)
    assert (search.course is course) is takes
    assert course.components == ["the rival"]


def test_drives_hold_at_standstill_as_fitted_recordings_show_it() -> None:
    """Beside what was found in motion where that was asked, else beside nothing; else as described."""
    search = diagnosis._Led.__new__(diagnosis._Led)
    first = SimpleNamespace(standstill="beside nothing", examination=SimpleNamespace(whitening="noise"))
    search.course = cast(Any, SimpleNamespace(first=first))
    search.question = cast(Any, SimpleNamespace(at_reversals=True))
    search.standstill = None
    other = cast(Any, ("another recording",))
    assert search._validation(other) == Validation(other, cast(Any, "noise"), cast(Any, "beside nothing"))
    found = cast(Any, ("beside what was found",))
    search.standstill = found
    assert search._validation(other).standstill is found
    search.standstill, search.question = None, cast(Any, SimpleNamespace(at_reversals=False))
    assert search._validation(other).standstill is None


def test_what_was_found_is_confirmed_in_that_loop() -> None:
    class Asked(Exception):
        """Whether it was."""

    def validation(prepared: Any) -> Validation:
        raise Asked(prepared)

    search = SimpleNamespace(course=SimpleNamespace(first=None), validation="other", _validation=validation)
    with pytest.raises(Asked, match="other"):
        Search._answer(cast(Any, search))
