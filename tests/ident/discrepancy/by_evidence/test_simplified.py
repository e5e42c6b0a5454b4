"""Names of a set: a limit that is likelier than a form takes its place; all are asked in the same way."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide import names
from ident.discrepancy.confirmation import Shown
from ident.effects.vocabulary import family_named


def test_a_form_that_its_limit_stands_for_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Found by a drawn log: the form was looked for in a list that the limit had taken it out of."""
    falling = SimpleNamespace(key=("stribeck_friction", (1,)), family=family_named("stribeck_friction"))
    dry = SimpleNamespace(key=("coulomb_friction", (1,)), family=family_named("coulomb_friction"))
    listed = names.probabilities({dry.key: 5.0, falling.key: 4.0, names.NOTHING: 0.0})
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
    simplest: Any = names.simplified(search, SimpleNamespace(found=found, entries=()), None)  # type: ignore[arg-type]
    assert [one.candidate.key for one in simplest.found.members] == [dry.key]
    assert simplest.found.log_posterior == -2.0


def test_a_name_is_asked_again_as_its_rivals_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refined shapes have their price; where those of a grid do for a rival, they do for the name, too."""
    said = asked(monkeypatch, rival=11.0, own=12.0, shares={"nothing": UNSEEN, "rival": UNSEEN})
    assert said.names[0].key == OWN and said.names[0].placed == "as it was found"
    assert said.log_odds(OWN) == 12.0


def test_other_motion_decides_with_the_rows_that_were_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against nothing, and between two names, each at half its nats; unasked names go with the found one."""
    whole, none = Shown(1.0, 0.1), Shown(0.0, 0.1)
    said = asked(monkeypatch, rival=11.0, own=12.0, shares={"nothing": whole, "rival": whole})
    assert said.log_odds(OWN) == pytest.approx(12.0 + 25.0)
    assert said.log_odds(RIVAL) == pytest.approx(11.0 + 25.0 - 25.0)
    said = asked(monkeypatch, rival=11.0, own=12.0, shares={"nothing": whole, "rival": none})
    assert said.log_odds(RIVAL) == pytest.approx(11.0 + 25.0 + 25.0)
    assert said.names[0].key == RIVAL
    said = asked(monkeypatch, rival=11.0, own=12.0, shares={"nothing": none, "rival": UNSEEN})
    assert said.log_odds(OWN) == pytest.approx(12.0 - 25.0)


def test_something_without_a_name_has_the_evidence_of_the_nearest_name_and_any_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unknown = (names.NO_NAME, OWN[1])
    said = asked(monkeypatch, rival=1.0, own=200.0, shares={"nothing": UNSEEN, "rival": UNSEEN})
    assert said.probability(unknown) == pytest.approx(0.1 / 1.1) and said.named >= names.SURE
    half = Shown(0.5, 0.05)
    said = asked(monkeypatch, rival=1.0, own=200.0, shares={"nothing": half, "rival": UNSEEN})
    odds = np.log(0.1) + 0.5 * half.nats_of_no_name
    assert said.log_odds(unknown) - said.log_odds(OWN) == pytest.approx(odds)
    assert said.probability(unknown) > 0.99 and said.named < 0.01


OWN, RIVAL = ("load_dependent_friction", (1,)), ("torque_ripple", (1,))
UNSEEN = Shown(0.0, 0.0)


def asked(
    monkeypatch: pytest.MonkeyPatch, rival: float, own: float, shares: Mapping[str, Shown]
) -> names.Slot:
    """The names of a set with one member, of which the rows that were fitted have so many nats.

    Args:
        monkeypatch: of the test.
        rival, own: log odds of another name and of its own.
        shares: that other motion shows of the set against nothing and against the rival.
    """
    candidates = [SimpleNamespace(key=key, family=SimpleNamespace(contains=())) for key in (RIVAL, OWN)]
    listed = [screened(one, nats) for one, nats in zip(candidates, (rival, own), strict=True)]
    monkeypatch.setattr(names, "screen", lambda *given: listed)
    without, other = SimpleNamespace(log_posterior=0.0), SimpleNamespace(log_posterior=rival)
    search: Any = SimpleNamespace(
        problem=None,
        replaced=lambda without, others: [
            other if one is listed[0] else SimpleNamespace(log_posterior=own) for one in others
        ],
    )
    held: Any = SimpleNamespace(
        shown=lambda found, against: shares["nothing" if against is without else "rival"]
    )
    member = SimpleNamespace(candidate=candidates[1], entry=SimpleNamespace(placed="as it was found"))
    found: Any = SimpleNamespace(found=SimpleNamespace(members=[member], log_posterior=9.0), entries=())
    return names.slot(search, found, 0, without, held)  # type: ignore[arg-type]


def screened(candidate: object, fitted: float) -> SimpleNamespace:
    """A form of a name, and what its set is worth once its shapes are fitted."""
    best = SimpleNamespace(entry=SimpleNamespace(placed=None))
    return SimpleNamespace(candidate=candidate, fitted=fitted, log_odds=-1.0, best=best)
