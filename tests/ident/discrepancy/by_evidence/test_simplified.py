"""Names of a set: a limit that is likelier than a form takes its place; all are asked in the same way."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from ident.discrepancy.by_evidence.decide import names
from ident.effects.vocabulary import family_named


def test_a_form_that_its_limit_stands_for_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Found by a drawn log: the form was looked for in a list that the limit had taken it out of."""
    falling = SimpleNamespace(key=("stribeck_friction", (1,)), family=family_named("stribeck_friction"))
    dry = SimpleNamespace(key=("coulomb_friction", (1,)), family=family_named("coulomb_friction"))
    listed = names.as_limit(names.probabilities({dry.key: 5.0, falling.key: 4.0, names.NOTHING: 0.0}))
    assert all(one.key != falling.key for one in listed)
    monkeypatch.setattr(names, "slot", lambda *given: names.Slot(listed))
    monkeypatch.setattr(names, "screen", lambda *given: [screened(dry, -3.0), screened(dry, -2.0)])
    monkeypatch.setattr(names, "replace", lambda searched, found: SimpleNamespace(found=found, entries=()))
    search: Any = SimpleNamespace(
        problem=None,
        without=lambda found, number: None,
        replaced=lambda without, others: [
            SimpleNamespace(members=[one], log_posterior=one.fitted) for one in others
        ],
    )
    found = SimpleNamespace(members=[SimpleNamespace(candidate=falling)])
    simplest: Any = names.simplified(search, SimpleNamespace(found=found, entries=()))  # type: ignore[arg-type]
    assert [one.candidate.key for one in simplest.found.members] == [dry.key]
    assert simplest.found.log_posterior == -2.0


def test_a_name_is_asked_again_as_its_rivals_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refined shapes have their price; where those of a grid do for a rival, they do for the name, too."""
    own = SimpleNamespace(key=("load_dependent_friction", (1,)), family=SimpleNamespace(contains=()))
    rival = SimpleNamespace(key=("directional_efficiency", (1,)), family=SimpleNamespace(contains=()))
    monkeypatch.setattr(names, "screen", lambda *given: [screened(rival, 11.0), screened(own, 12.0)])
    search: Any = SimpleNamespace(
        problem=None,
        replaced=lambda without, others: [SimpleNamespace(log_posterior=one.fitted) for one in others],
    )
    member = SimpleNamespace(candidate=own, entry=SimpleNamespace(placed="as it was found"))
    found: Any = SimpleNamespace(found=SimpleNamespace(members=[member], log_posterior=9.0), entries=())
    said = names.slot(search, found, 0, SimpleNamespace(log_posterior=0.0))  # type: ignore[arg-type]
    assert said.names[0].key == own.key and said.names[0].placed == "as it was found"
    assert said.log_odds(own.key) == 12.0


def screened(candidate: object, fitted: float) -> SimpleNamespace:
    """A form of a name, and what its set is worth once its shapes are fitted."""
    best = SimpleNamespace(entry=SimpleNamespace(placed=None))
    return SimpleNamespace(candidate=candidate, fitted=fitted, log_odds=-1.0, best=best)
