"""Names of a set: a limit that is likelier than a form takes its place; all are asked in the same way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide import names, told
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.confirmation import Shown
from ident.effects.vocabulary import family_named


def test_a_form_that_its_limit_stands_for_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the best form of the limit, where the limit is in the 95 % set of a form that is less than sure."""
    assert simplest(monkeypatch, limit=5.0) == ("coulomb_friction", -2.0)
    assert simplest(monkeypatch, limit=2.0) == ("coulomb_friction", -2.0)


def test_a_form_that_is_sure_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    assert simplest(monkeypatch, limit=1.7) == ("stribeck_friction", 0.0)


@pytest.mark.parametrize("limit", [1.7, -5.0])
def test_a_form_is_its_limit_where_what_makes_it_that_form_may_be_nothing(
    monkeypatch: pytest.MonkeyPatch, limit: float
) -> None:
    """A straight spring on joint 5 was a cable that stiffens by -0.04 ± 0.12 N·m/rad³, with 0.90 (97043)."""
    assert simplest(monkeypatch, limit, essential=(0,), size=0.3) == ("coulomb_friction", -2.0)
    assert simplest(monkeypatch, limit, essential=(0,), size=0.5) == ("stribeck_friction", 0.0)
    assert simplest(monkeypatch, limit, essential=(), size=0.3) == ("stribeck_friction", 0.0)


def simplest(
    monkeypatch: pytest.MonkeyPatch, limit: float, essential: tuple[int, ...] = (), size: float = 1.0
) -> tuple[str, float]:
    """Name and worth of a set with one form, of log odds 4, whose limit has these.

    Args:
        monkeypatch: of the test.
        limit: log odds of it.
        essential: parameters without which the form is its limit.
        size: of the form's one parameter, with a deviation of 0.2.
    """
    family = replace(family_named("stribeck_friction"), essential=essential)
    falling = SimpleNamespace(key=("stribeck_friction", (1,)), family=family)
    dry = SimpleNamespace(key=("coulomb_friction", (1,)), family=family_named("coulomb_friction"))
    listed = names.probabilities({dry.key: limit, falling.key: 4.0, names.NOTHING: -9.0})
    monkeypatch.setattr(told, "_its_parts", lambda *given: None)
    monkeypatch.setattr(told, "slot", lambda *given: names.Slot(listed))
    monkeypatch.setattr(told, "screen", lambda *given: [screened(dry, -3.0), screened(dry, -2.0)])
    monkeypatch.setattr(told, "replace", lambda searched, found: SimpleNamespace(found=found, entries=()))
    search: Any = SimpleNamespace(
        problem=None,
        without=lambda found, number: None,
        replaced=lambda without, others: [
            SimpleNamespace(members=[SimpleNamespace(candidate=one.candidate)], log_posterior=one.fitted)
            for one in others
        ],
    )
    placed = SimpleNamespace(parameters=(SimpleNamespace(name="rise", unit="N·m"),))
    found = SimpleNamespace(
        members=[SimpleNamespace(candidate=falling, entry=SimpleNamespace(placed=placed))],
        theta=lambda number: (np.array([size]), np.array([[0.04]])),
        log_posterior=0.0,
    )
    ended: Any = told.simplified(search, SimpleNamespace(found=found, entries=()), None)  # type: ignore[arg-type]
    (member,) = ended.found.members
    return member.candidate.key[0], ended.found.log_posterior


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


def test_nothing_is_asked_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    said = asked(monkeypatch, rival=-9.0, own=9.0, shares={"nothing": Shown(0.0, 0.2), "rival": UNSEEN})
    assert said.log_odds(OWN) == pytest.approx(9.0 - 6.25)
    whole = sum(np.exp(one.log_odds) for one in said.names)
    assert 1.0 - said.something == pytest.approx(1.0 / whole) and whole < 500.0


def test_a_limit_in_the_set_says_what_its_likelier_form_says(monkeypatch: pytest.MonkeyPatch) -> None:
    form = ("directional_efficiency", (1,))
    unseen = {"nothing": UNSEEN, "rival": UNSEEN}
    said = asked(monkeypatch, rival=13.0, own=12.0, shares=unseen, other=form)
    assert said.probability(form) == 0.0 and said.named == said.probability(OWN) > 0.9
    assert [one.key for one in said.names[0].forms] == [form]


def test_a_form_that_says_something_else_of_other_motion_is_a_name_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Slow motion is even about a power of the speed: that is no reason to call it viscous."""
    form = ("directional_efficiency", (1,))
    unseen = {"nothing": UNSEEN, "rival": UNSEEN}
    said = asked(monkeypatch, rival=12.0, own=12.0, shares=unseen, other=form, same=False)
    assert said.probability(form) == pytest.approx(said.probability(OWN)) and said.names[0].forms == ()
    assert said.probability(OWN) < 0.5
    unlikely = asked(monkeypatch, rival=8.0, own=12.0, shares=unseen, other=form, same=False)
    assert unlikely.probability(form) == 0.0  # not asked: it is in no set
    likelier = asked(monkeypatch, rival=13.0, own=12.0, shares=unseen, other=form, same=False)
    assert [one.key for one in likelier.names[0].forms] == [form] and likelier.named == likelier.probability(
        OWN
    )


@pytest.mark.parametrize("rival", [11.0, 13.0])
def test_a_form_of_which_the_recordings_show_no_more_than_its_limit_is_that(
    monkeypatch: pytest.MonkeyPatch, rival: float
) -> None:
    """However likely: a power four of the speed of −0.2 ± 4.3 N·m beside viscous friction of 1.52 ± 0.02."""
    form, unseen = ("directional_efficiency", (1,)), {"nothing": UNSEEN, "rival": UNSEEN}
    said = asked(monkeypatch, rival=rival, own=12.0, shares=unseen, other=form, same=False, adds=False)
    assert said.probability(form) == 0.0 and said.names[0].forms == ()
    assert said.named == said.probability(OWN) > 0.9


def test_something_without_a_name_may_be_the_law_that_several_names_describe(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """If that is likelier than what the one name leaves."""
    unknown, unseen = (NO_NAME, OWN[1]), {"nothing": UNSEEN, "rival": UNSEEN}
    likelier = asked(monkeypatch, rival=-9.0, own=12.0, shares=unseen, law=5.0)
    assert likelier.log_odds(unknown) == pytest.approx(12.0 + 5.0)
    less = asked(monkeypatch, rival=-9.0, own=12.0, shares=unseen, law=-9.0)
    none = asked(monkeypatch, rival=-9.0, own=12.0, shares=unseen)
    assert less.log_odds(unknown) == none.log_odds(unknown) > 12.0 - 9.0


def test_something_without_a_name_has_the_evidence_of_the_nearest_name_and_any_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    unknown = (NO_NAME, OWN[1])
    said = asked(monkeypatch, rival=1.0, own=200.0, shares={"nothing": UNSEEN, "rival": UNSEEN})
    assert said.probability(unknown) == pytest.approx(0.1 / 1.1) and said.named >= names.SURE
    half = Shown(0.5, 0.05)
    said = asked(monkeypatch, rival=1.0, own=200.0, shares={"nothing": half, "rival": UNSEEN})
    odds = np.log(0.1) + 0.5 * Shown(0.5, float(np.hypot(0.05, 0.03))).nats_of_no_name  # a form's own error
    assert said.log_odds(unknown) - said.log_odds(OWN) == pytest.approx(odds)
    assert said.probability(unknown) > 0.99 and said.named < 0.01


def test_a_name_is_sure_by_its_own_torque_where_parameters_cannot_have_made_up_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Viscous friction that the model's own would be in the set without it, ten deviations off its prior."""
    shares = {"nothing": Shown(3.2, 8.0), "alone": Shown(1.0, 0.02), "rival": UNSEEN}
    free, priced = (asked(monkeypatch, 1.0, 200.0, shares, price=price) for price in (0.0, 50.0))
    # Of a form that may be 3 % wrong itself; with σ = 0.02 alone it is above 0.98.
    odds = np.log(0.1) + 0.5 * Shown(1.0, float(np.hypot(0.02, 0.03))).nats_of_no_name
    assert free.named < 0.93
    assert priced.named == pytest.approx(1.0 / (1.0 + np.exp(odds)), abs=1e-6)


def test_a_name_whose_size_is_impossible_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """However clearly both motions show what it says."""
    whole = {"nothing": Shown(1.0, 0.01), "rival": UNSEEN}
    said = asked(monkeypatch, rival=1.0, own=200.0, shares=whole, possible=-30.0)
    assert said.named < 0.01 and said.probability((NO_NAME, OWN[1])) > 0.99
    assert asked(monkeypatch, rival=1.0, own=200.0, shares=whole).named > 0.98


def test_of_a_play_other_motion_may_show_no_more_than_two_thirds(monkeypatch: pytest.MonkeyPatch) -> None:
    shares = {"nothing": Shown(0.65, 0.04), "rival": UNSEEN}
    assert asked(monkeypatch, rival=1.0, own=200.0, shares=shares).named < 0.01
    assert asked(monkeypatch, rival=1.0, own=200.0, shares=shares, rough=True).named > 0.88


OWN, RIVAL = ("load_dependent_friction", (1,)), ("torque_ripple", (1,))
UNSEEN = Shown(0.0, 0.0)


def asked(
    monkeypatch: pytest.MonkeyPatch,
    rival: float,
    own: float,
    shares: Mapping[str, Shown],
    other: names.Key = RIVAL,
    same: bool = True,
    adds: bool = True,
    possible: float = 0.0,
    price: float = 0.0,
    rough: bool = False,
    law: float = -np.inf,
) -> names.Slot:
    """The names of a set with one member, of which the rows that were fitted have so many nats.

    Args:
        monkeypatch: of the test.
        rival, own: log odds of another name and of its own.
        shares: that other motion shows of the set against nothing and against the rival, and of its torque
            alone; as against nothing where that is not said.
        other: the rival's name.
        same: whether both say the same of motion all over the travel.
        adds: whether the other has more, as far as the recordings show.
        possible: log probability of the sizes.
        price: nats that parameters of the set without it cost.
        rough: whether rows hold only the most of it.
        law: log odds of any law of the speed against the names that are laws of it.
    """
    monkeypatch.setattr(names, "free_law", lambda *given: law)
    monkeypatch.setattr(names, "left_beside", lambda *given: 0.0)
    monkeypatch.setattr(names, "odds_beforehand", lambda *given: 0.1)
    family = SimpleNamespace(contains=(), rough=rough)
    candidates = [SimpleNamespace(key=key, family=family) for key in (other, OWN)]
    listed = [screened(one, nats) for one, nats in zip(candidates, (rival, own), strict=True)]
    monkeypatch.setattr(names, "screen", lambda *given: listed)
    moved = SimpleNamespace(known=np.array([np.sqrt(2.0 * price), 9.0]))  # a parameter and a lag
    without = SimpleNamespace(log_posterior=0.0, posterior=moved)
    with_rival = SimpleNamespace(log_posterior=rival)
    known = SimpleNamespace(precision=np.ones(2))
    search: Any = SimpleNamespace(
        problem=SimpleNamespace(
            rows=SimpleNamespace(known=known),
            beta=SimpleNamespace(count=1),
            friction=SimpleNamespace(log_possible=lambda *given: possible),
        ),
        elsewhere=SimpleNamespace(same=lambda *given: same, adds=lambda *given: adds),
        replaced=lambda without, others: [
            with_rival if one is listed[0] else SimpleNamespace(log_posterior=own) for one in others
        ],
    )
    held: Any = SimpleNamespace(
        shown=lambda found, against: shares["nothing" if against is without else "rival"],
        alone=lambda found, number: shares.get("alone", shares["nothing"]),
    )
    placed = SimpleNamespace(placed="as it was found")
    member = SimpleNamespace(candidate=candidates[1], entry=placed, is_friction=False)
    unmoved = SimpleNamespace(known=np.zeros(2))
    fitted = SimpleNamespace(members=[member], log_posterior=9.0, posterior=unmoved)
    found: Any = SimpleNamespace(found=fitted, entries=())
    return names.slot(search, found, 0, without, held)  # type: ignore[arg-type]


def screened(candidate: object, fitted: float) -> SimpleNamespace:
    """A form of a name, and what its set is worth once its shapes are fitted."""
    best = SimpleNamespace(entry=SimpleNamespace(placed=None))
    return SimpleNamespace(candidate=candidate, fitted=fitted, log_odds=-1.0, best=best)
