"""A name's probability after what recordings that were not fitted say against it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import robots
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.by_evidence.taken import weighed
from ident.discrepancy.confirmation import Confirmation, Shown
from ident.discrepancy.results import Finding, Possible
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel

TX40 = robots.load("tx40")
SURE = Shown(1.0, 0.01)
JOINT = (5,)


def finding(name: str, confirmation: Confirmation, probability: float, *others: Possible) -> Finding:
    """Of joint 5, with some of what else is possible."""
    place = Place("drive", (4,))
    family = family_named(name)
    present: Any = Present(RegressorModel.of(TX40), RegressorModel.of(TX40).prior())
    shape = tuple(one.grid[0] for one in family.shapes(TX40, place))
    placed = family.effect(TX40, place, shape, present)
    none: Any = None
    return Finding(
        effect=name,
        sentence="",
        scope="drive",
        joints=JOINT,
        parameters=(),
        p_value=0.0,
        score=0.0,
        threshold=0.0,
        held_out_gain=0.0,
        indistinguishable_from=(),
        mode="prior",
        gap=none,
        confirmation=confirmation,
        placed=placed,
        binned_residual=none,
        ranking=(),
        probability=probability,
        held=(Possible(name, JOINT, probability), *others),
    )


def one_in_twenty(before: float, after: float) -> float:
    """What speaks against a name at 95 % does so by chance one time in twenty."""
    return 0.05 * before + 0.95 * after


def test_what_nothing_speaks_against_keeps_its_probability() -> None:
    for confirmation in (
        Confirmation(SURE, Shown(0.9, 0.1)),
        Confirmation(Shown(0.45, 0.3), None),
        Confirmation(SURE, None, "a size that may as well be nothing"),
    ):
        one = finding("rotor_inertia", confirmation, 0.992)
        assert weighed(one, TX40) is one


@pytest.mark.parametrize(
    ("name", "form"), [("rotor_inertia", 0.03), ("coulomb_friction", 0.1), ("backlash", 0.3)]
)
def test_what_the_loop_takes_from_a_name_something_without_a_name_has(name: str, form: float) -> None:
    """To what the form of the name may be wrong by: there a dead time had been a rotor, with 0.992."""
    loop = Shown(0.3, 0.05)
    one = finding(name, Confirmation(SURE, loop), 0.992)
    odds = 0.992 / 0.008 * np.exp(-loop.nats_against(form))
    left = weighed(one, TX40)
    assert left.probability == pytest.approx(one_in_twenty(0.992, odds / (1.0 + odds)))
    assert left.held[0].name == (NO_NAME if odds < 1.0 else name)
    assert sum(each.probability for each in left.held) >= 0.95
    assert replace(left, probability=one.probability, held=one.held) == one


def test_other_names_keep_their_odds() -> None:
    """They were not asked; and the likelier of two shares decides, not both."""
    rival = Possible("time_delay", JOINT, 0.3)
    against = Shown(0.12, 0.02)
    one = finding("rotor_inertia", Confirmation(against, Shown(0.3, 0.05)), 0.6, rival)
    left = weighed(one, TX40)
    assert [(each.name, each.joints) for each in left.held] == [("time_delay", JOINT), (NO_NAME, JOINT)]
    assert [each.probability for each in left.held] == pytest.approx(
        [one_in_twenty(0.3, 0.75), one_in_twenty(0.1, 0.25)]
    )
    after = 1.5 * np.exp(-against.nats_against(0.03))
    assert left.probability == pytest.approx(one_in_twenty(0.6, after), rel=1e-3)


@pytest.mark.parametrize(
    ("seen", "before", "after"),
    [
        # Four right static frictions, and two that a loop made up where something else repeats.
        (Shown(1.07, 0.08), 0.909, 0.946),
        (Shown(0.90, 0.08), 0.909, 0.933),
        (Shown(0.71, 0.09), 0.909, 0.910),
        (Shown(0.0, 0.0), 0.909, 0.909),
        (Shown(0.82, 0.31), 0.5, 0.536),
        (Shown(1.19, 0.36), 0.5, 0.604),
    ],
)
def test_of_what_reversals_showed_other_motion_speaks_for_the_name_or_for_what_has_none(
    seen: Shown, before: float, after: float
) -> None:
    """Where too much of its place has no name, the name is not confirmed."""
    one = finding("static_friction", Confirmation(seen, seen, of_reversals=True), before)
    left = weighed(one, TX40)
    odds = before / (1.0 - before) * np.exp(-0.5 * seen.to_form(0.3).nats_of_no_name)
    assert left.probability == pytest.approx(odds / (1.0 + odds))
    assert left.probability == pytest.approx(after, abs=1e-3)
    assert left.confirmation.passed is (after > 0.9 and not seen.of_nothing)
    words = f"something without a name is there with probability {1.0 - after:.2f}"
    assert left.confirmation.unsure == ("" if after > 0.9 else words)
    assert replace(left, probability=before, held=one.held, confirmation=one.confirmation) == one


def test_of_what_the_moving_arm_shows_that_is_in_its_probability_already() -> None:
    one = finding("static_friction", Confirmation(Shown(0.82, 0.31), None), 0.5)
    assert weighed(one, TX40) is one


def test_other_names_of_what_reversals_showed_keep_their_odds() -> None:
    rival = Possible("stribeck_friction", JOINT, 0.3)
    seen = Shown(1.0, 0.05)
    one = finding("static_friction", Confirmation(seen, None, of_reversals=True), 0.6, rival)
    left = {each.name: each.probability for each in weighed(one, TX40).held}
    assert left["static_friction"] / left["stribeck_friction"] == pytest.approx(2.0)
    assert sum(left.values()) == pytest.approx(1.0) and left["static_friction"] > 0.6


def test_a_sure_name_can_lose_all_but_a_twentieth_of_its_probability() -> None:
    """Next to nothing is left beside a name of probability 1; and something without a name has more then."""
    one = finding("coulomb_friction", Confirmation(Shown(-900.0, 0.1), None), 1.0)
    left = weighed(one, TX40)
    assert left.probability == pytest.approx(0.05) and [each.name for each in left.held] == [NO_NAME]
