"""What has no name: any share of the nearest name may be there on other motion."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import cauchy

from ident.discrepancy.by_evidence.decide import no_name
from ident.discrepancy.by_evidence.decide.no_name import (
    form_error,
    left_beside,
    nats_of_left,
    odds_of_no_name,
    price_of_parameters,
)
from ident.discrepancy.confirmation import Shown

SHARP, SILENT = Shown(1.0, 0.1), Shown(3.2, 8.0)
"""All of it is there; nothing is said."""


def with_form(one: Shown) -> float:
    """Of a name that may be 3 % wrong in its form."""
    return Shown(one.share, float(np.hypot(one.sigma, 0.03))).nats_of_no_name


def test_no_form_is_right_to_a_per_mille() -> None:
    """A ripple with 91 728 nats had 0.946 ± 0.003 of itself on other motion, and no name (96218)."""
    close = Shown(0.946, 0.003)
    assert odds_of_no_name(close, close, 0.0, 0.0, 0.0) == pytest.approx(np.log(0.1) + 0.5 * with_form(close))
    assert odds_of_no_name(close, close, 0.0, 0.0, 0.0) < np.log(0.1) < 10.0 < 0.5 * close.nats_of_no_name
    silent = Shown(0.0, 0.0)
    assert odds_of_no_name(silent, silent, 0.0, 0.0, 0.0) == pytest.approx(np.log(0.1))


def test_friction_is_another_some_minutes_later() -> None:
    """Half of a real arm's log had 0.85 ± 0.03 of the friction that couples its wrist, and it had no name."""
    some, wide = Shown(0.850, 0.033), Shown(0.850, float(np.hypot(0.033, 0.1))).nats_of_no_name
    odds = odds_of_no_name(some, some, 0.0, 0.0, 0.0, form=0.1)
    assert odds == pytest.approx(np.log(0.1) + 0.5 * wide)
    assert odds < -np.log(9.0) < -1.0 < odds_of_no_name(some, some, 0.0, 0.0, 0.0)


def test_how_far_a_name_may_be_another_on_other_motion_is_asked_of_what_it_is() -> None:
    of = form_error
    assert of(False, False) < of(False, True) < of(True, False) == of(True, True)


def test_of_what_rows_hold_the_most_of_alone_a_third_may_be_another() -> None:
    """Of a play that is there other motion showed 0.58 ± 0.04: where its edges lie a few rows say (96216)."""
    some = Shown(0.577, 0.036)
    wide = Shown(0.577, float(np.hypot(0.036, 0.3))).nats_of_no_name
    assert odds_of_no_name(some, some, 0.0, 0.0, 0.0, form=0.3) == pytest.approx(np.log(0.1) + 0.5 * wide)
    assert (
        odds_of_no_name(some, some, 0.0, 0.0, 0.0, form=0.3)
        < -1.5
        < 10.0
        < odds_of_no_name(some, some, 0.0, 0.0, 0.0)
    )


def test_names_of_impossible_sizes_are_something_without_a_name() -> None:
    """Coarsened as all evidence is: the sizes come of the same rows. What is left counts by its prior."""
    nats = with_form(SHARP)
    assert odds_of_no_name(SHARP, SHARP, 0.0, 0.0, 0.0) == pytest.approx(np.log(0.1) + 0.5 * nats)
    assert odds_of_no_name(SHARP, SHARP, 0.0, -20.0, 0.0) == pytest.approx(np.log(0.1) + 0.5 * nats + 10.0)
    assert odds_of_no_name(SHARP, SHARP, 0.0, 0.0, 3.0) == pytest.approx(np.log(0.1) + 0.5 * nats + 3.0)


def test_what_parameters_make_up_for_at_a_price_is_no_refuge_of_what_has_no_name() -> None:
    """Other motion shows all of the name's torque, and nothing of what differs from a set fitted without."""
    nats = np.array([with_form(one) for one in (SHARP, SILENT)])
    assert nats[0] < -1.5 < -0.5 < nats[1] < 0.5
    for price, expected in ((0.0, nats[1]), (1.0, nats[1] - 1.0), (50.0, nats[0])):
        odds = odds_of_no_name(SHARP, SILENT, price, 0.0, 0.0)
        assert odds == pytest.approx(np.log(0.1) + 0.5 * expected)
    assert odds_of_no_name(SILENT, SHARP, 0.0, 0.0, 0.0) == pytest.approx(np.log(0.1) + 0.5 * nats[1])


def test_only_parameters_with_a_prior_have_a_price_and_it_is_none_where_they_are_likelier() -> None:
    # The last factor is no parameter of the model: a lag between the channels.
    one, other = (SimpleNamespace(known=np.array(known)) for known in ([3.0, 50.0, 9.0], [1.0, 2.0, 0.0]))
    precision = np.array([1.0, 0.0])
    assert price_of_parameters(precision, one, other) == pytest.approx(4.0)  # type: ignore[arg-type]
    assert price_of_parameters(precision, other, one) == 0.0  # type: ignore[arg-type]


def test_a_name_beside_what_it_leaves_unexplained_is_less_sure() -> None:
    """A name that is there leaves what an accepted run does and 3 % of itself, all else mostly more."""
    accepted, explains = 0.04, 1.0
    form = np.hypot(accepted, 0.03 * explains)
    assert form == pytest.approx(0.05)

    def nats(*misfit: float) -> float:
        n = len(misfit)
        return nats_of_left(np.array(misfit), np.full(n, accepted), np.full(n, explains))

    assert [nats(misfit) for misfit in (0.001, 0.04, 0.0499)] == pytest.approx([np.log(0.2)] * 3)

    def more(misfit: float) -> float:
        anything = 1.0 / np.log(np.hypot(misfit, explains) / form)
        return float(anything / cauchy.pdf(np.log(misfit / form), scale=0.5))

    for misfit in (0.06, 0.1, 0.3):
        assert nats(misfit) == pytest.approx(np.log(0.2 + 0.8 * more(misfit)))
    assert nats(0.3) > 0.0 > nats(0.06)
    # At one of two joints as much as usual: then at the other there is more for certain, of three cases.
    assert nats(0.3, 0.04) == pytest.approx(np.log(0.2 + 0.8 * more(0.3) / 3.0))
    both = (more(0.3) * more(0.2) + more(0.3) + more(0.2)) / 3.0
    assert nats(0.3, 0.2) == pytest.approx(np.log(0.2 + 0.8 * both))
    assert nats(0.3, 0.2) > nats(0.3) > nats(0.3, 0.04) > nats(0.3, 0.04, 0.04) > nats(0.04, 0.04)


def test_what_an_effect_of_the_arm_leaves_is_asked_at_every_joint_where_it_acts() -> None:
    """A load that swings is a payload at the shoulder, not at the wrist; where it does nothing none asks."""
    assert left_at(torque=(9.0, 2.0, 0.001), misfit=(0.01, 0.01, 0.9)) == pytest.approx(np.log(0.2))
    wrist = left_at(torque=(9.0, 2.0, 0.001), misfit=(0.01, 0.5, 0.9))
    assert wrist == pytest.approx(nats_of_left(np.array([0.01, 0.5]), np.full(2, 0.01), np.array([9.0, 2.0])))
    assert wrist > 0.5


def test_what_rows_hold_the_most_of_leaves_some_of_itself() -> None:
    """A play of 0.45 N·m with 0.2 left: instants of impacts, which no record holds."""
    assert left_at(torque=(0.45, 0.1), misfit=(0.2, 0.01), rough=True) == pytest.approx(0.0)
    assert left_at(torque=(0.45, 0.1), misfit=(0.2, 0.01)) > 1.0


@pytest.mark.parametrize(("explains", "odds"), [(0.9, 1.0), (1.1, 0.1)])
def test_what_explains_no_more_than_an_arm_leaves_is_as_likely_as_not_what_has_no_name(
    monkeypatch: pytest.MonkeyPatch, explains: float, odds: float
) -> None:
    """A ripple and an eccentric encoder beside a soft foot, 0.9 each; other motion showed nothing of them."""
    monkeypatch.setattr(no_name, "torque_of", lambda *given: np.array([3.0, explains]))
    monkeypatch.setattr(no_name, "own_joint", lambda *given: 1)
    monkeypatch.setattr(no_name, "usual_at", lambda problem, found, joint: (9.0, 1.0)[joint])
    nothing: Any = None
    assert no_name.odds_beforehand(nothing, nothing, 0) == odds
    silent = Shown(0.0, 0.0)
    assert odds_of_no_name(silent, silent, 0.0, 0.0, 0.0, outside=odds) == pytest.approx(np.log(odds))


def test_where_no_run_says_what_is_usual_nothing_is_too_much() -> None:
    assert left_at(torque=(0.45, 0.1), misfit=(0.2, 0.01), of_run=False) == 0.0


@pytest.mark.parametrize(("gear", "its_own"), [((0.0, 0.3), True), ((0.3, 0.0), False), ((0.01, 0.0), True)])
def test_what_a_gear_leaves_that_gives_way_is_not_left_beside_what_is_beside_it(
    gear: tuple[float, float], its_own: bool
) -> None:
    """Rows twenty times as noisy at joint 0: of one elsewhere, there, or doing little there."""
    left = left_at(torque=(0.45, 0.1), misfit=(0.01, 0.01), excess=(20.0, 1.0), gear=gear)
    assert (left > 1.0) is its_own


def left_at(
    torque: tuple[float, ...],
    misfit: tuple[float, ...],
    rough: bool = False,
    of_run: bool = True,
    excess: tuple[float, ...] | None = None,
    gear: tuple[float, ...] | None = None,
) -> float:
    """Of one member that acts at all joints, each of which may leave 0.01 N·m; a gear may be beside it."""
    n = len(torque)
    elastic = SimpleNamespace(
        candidate=SimpleNamespace(family=SimpleNamespace(rough=True)),
        entry=SimpleNamespace(placed=SimpleNamespace(torque=np.array(gear))),
    )
    part = SimpleNamespace(columns=columns)
    prepared = SimpleNamespace(used=np.ones((4, n), dtype=np.bool_), parts=(part,), repeats=False)
    problem: Any = SimpleNamespace(
        prepared=prepared,
        rows=SimpleNamespace(
            noise=[SimpleNamespace(marginal=0.01)] * n,
            known=SimpleNamespace(target=np.zeros((4, n)), columns=np.zeros((4, n, 1))),
            thin=columns,
        ),
        misfit=SimpleNamespace(accepted=np.full(n, 0.01), of_run=of_run),
    )
    found: Any = SimpleNamespace(
        members=[
            SimpleNamespace(
                joints=range(n),
                candidate=SimpleNamespace(key=("payload", ()), family=SimpleNamespace(rough=rough)),
                entry=SimpleNamespace(placed=SimpleNamespace(torque=np.array(torque))),
            ),
            *([] if gear is None else [elastic]),
        ],
        theta=lambda number: (np.ones(1), np.eye(1)),
        level=SimpleNamespace(kappa=np.array(misfit), excess=np.array(excess or (1.0,) * n)),
        posterior=SimpleNamespace(known=np.zeros(1)),
    )
    return left_beside(problem, found, 0)


def columns(placed: Any) -> Any:
    """Four rows × joints × one parameter."""
    return np.tile(placed.torque, (4, 1))[:, :, np.newaxis]
