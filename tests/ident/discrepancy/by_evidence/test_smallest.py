"""The smallest size that would be named: by its formulas against drawn scores, and its limits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.special import logsumexp

from ident.discrepancy.by_evidence.decide.names import SURE
from ident.discrepancy.by_evidence.decide.screening import _alike
from ident.discrepancy.by_evidence.decide.state import ONE_MORE, TEMPERATURE
from ident.discrepancy.by_evidence.power import planned
from ident.discrepancy.by_evidence.power.expected import Expectation
from ident.discrepancy.by_evidence.power.odds import EVEN, SIZES, Odds
from ident.discrepancy.by_evidence.power.smallest import Smallest, _of_grid, worst_first
from ident.effects.family import Shape

ANY = (-np.inf, np.inf)
DRAWS = 4000
NEEDED = float(np.log(9.0))


def entry(
    name: str,
    count: int = 1,
    bounds: tuple[float, float] = ANY,
    centre: float = 0.0,
    essential: tuple[int, ...] = (0,),
    candidate: Any = None,
) -> Any:
    family = SimpleNamespace(essential=essential)
    white = SimpleNamespace(
        count=count,
        centre=np.full(count, centre),
        bounds=np.array([bounds] * count),
        scale=np.ones(count),
        unsaid=0.0,
    )
    own = candidate or SimpleNamespace(key=(name, (0,)), share=0.1, family=family, combinations=1)
    placed = SimpleNamespace(whole=centre != 0.0, of_measured=False)
    return SimpleNamespace(candidate=own, white=white, placed=placed)


def information(columns: int, strength: float, seed: int) -> Any:
    """(P, P) of columns that have something in common."""
    rows = np.random.default_rng(seed).standard_normal((40, columns))
    rows[:, 1] += 1.5 * rows[:, 0]
    return strength * rows.T @ rows


def scores(own: Any, theta: Any, seed: int) -> Any:
    """(draws, P) of data in which the columns have the factors θ (P,)."""
    root = np.linalg.cholesky(own)
    return own @ theta + np.random.default_rng(seed).standard_normal((DRAWS, theta.size)) @ root.T


def gains(own: Any, score: Any, entries: Any) -> Any:
    """(draws, entries) as the search screens them."""
    found, start = [], 0
    for one in entries:
        part = slice(start, start + one.white.count)
        drawn = score[:, part]
        block = np.broadcast_to(own[part, part], (drawn.shape[0], one.white.count, one.white.count))
        found.append(_alike(block, drawn, [one] * drawn.shape[0]))
        start = part.stop
    return np.array(found).T


@pytest.mark.parametrize("centre", [0.0, 2.0])
def test_the_mean_of_every_candidate_is_that_of_drawn_scores(centre: float) -> None:
    entries = [entry("true"), entry("wide", 2, centre=centre), entry("other")]
    own = information(4, 5.0, 1)
    size = 0.7
    means = Expectation.of(entries, own).means(0, np.ones(1)).at(np.array([size]))[0]
    drawn = gains(own, scores(own, np.array([size, 0.0, 0.0, 0.0]), 2), entries)
    for number in range(3):
        error = drawn[:, number].std() / np.sqrt(DRAWS)
        assert abs(drawn[:, number].mean() - means[number]) < 4.0 * error


def named(own: Any, size: float, entries: Any, judged: float = 1.0) -> float:
    """Share of drawn data in which the first entry is found, sure against nothing and ahead of all others.

    It is found by the rows that are fitted; the rest is by both motions, of which the second has ``judged``
    times the information of the first. Of what the first entry predicts there otherwise than another one, or
    than nothing, a share is there, with its deviation.
    """
    theta = np.zeros(own.shape[0])
    theta[0] = size
    fitted, others = scores(own, theta, 3), scores(judged * own, theta, 8)
    odds = TEMPERATURE * gains(own, fitted, entries) + np.log(ONE_MORE * 0.1)
    counts = np.cumsum([0, *(one.white.count for one in entries)])
    shown = [posterior(own, fitted, part) for part in map(slice, counts[:-1], counts[1:])]
    for number, other in enumerate([np.zeros_like(fitted), *shown[1:]]):
        change = shown[0] - other
        energy = judged * np.einsum("dp,pq,dq->d", change, own, change)
        there = np.sum(change * (others - judged * other @ own), axis=1)
        unknown = np.linalg.inv(own[:1, :1] + 1.0)[0, 0] * (judged * change @ own[:, 0]) ** 2
        nats = TEMPERATURE * (2.0 * there - energy) * energy / (2.0 * (energy + unknown))
        if number == 0:
            found, sure = odds[:, 0] > 0.0, odds[:, 0] + nats > NEEDED
        else:
            sure &= odds[:, 0] + nats >= odds[:, number]
    return float(np.mean(found & sure))


def posterior(own: Any, score: Any, part: slice) -> Any:
    """(draws, P) what an entry is fitted as."""
    whole = np.zeros_like(score)
    block = own[part, part] + np.eye(part.stop - part.start)
    whole[:, part] = score[:, part] @ np.linalg.inv(block)
    return whole


@pytest.mark.parametrize("strength", [3.0, 300.0])
@pytest.mark.parametrize("judged", [0.1, 1.0, 5.0])
def test_the_smallest_size_is_named_in_four_of_five(strength: float, judged: float) -> None:
    """However little the other motion has to say, and however much."""
    entries = [entry("true"), entry("other"), entry("wide", 2)]
    own = information(4, strength, 4)
    size, _ = Odds(entries, own, 0.9, 0.8, judged).smallest(0)
    assert named(own, size, entries, judged) == pytest.approx(0.8, abs=0.04)


def test_what_another_name_imitates_needs_to_be_larger_and_is_told_from_that_name() -> None:
    entries = [entry("true"), entry("other")]
    own = 100.0 * np.array([[1.0, 0.0], [0.0, 1.0]])
    apart, rival = Odds(entries, own, 0.9, 0.8, 1.0).smallest(0)
    assert rival == ("nothing", ())
    own = 100.0 * np.array([[1.0, 0.995], [0.995, 1.0]])
    near, rival = Odds(entries, own, 0.9, 0.8, 1.0).smallest(0)
    assert rival == ("other", (0,))
    assert near > 1.2 * apart
    assert named(own, near, entries) == pytest.approx(0.8, abs=0.04)
    own = 100.0 * np.ones((2, 2))
    assert Odds(entries, own, 0.9, 0.8, 1.0).smallest(0)[0] == np.inf


def test_a_rival_that_cannot_have_the_sign_is_none() -> None:
    """Both signs of the effect are asked about: one of them is told easily, the other is the answer."""
    own = 100.0 * np.array([[1.0, 0.995], [0.995, 1.0]])
    positive = entry("other", bounds=(0.0, np.inf))
    either = Odds([entry("true"), positive], own, 0.9, 0.8, 1.0)
    falls = Odds([entry("true", bounds=(-np.inf, 0.0)), positive], own, 0.9, 0.8, 1.0)
    rises = Odds([entry("true", bounds=(0.0, np.inf)), positive], own, 0.9, 0.8, 1.0)
    assert falls.smallest(0)[0] < rises.smallest(0)[0] == either.smallest(0)[0]


def test_of_several_shapes_the_one_in_the_middle_answers() -> None:
    shared = SimpleNamespace(
        key=("true", (0,)), share=0.1, family=SimpleNamespace(essential=()), combinations=3
    )
    entries = [entry("true", candidate=shared) for _ in range(3)]
    own = np.diag([400.0, 25.0, 100.0])
    odds = Odds(entries, own, 0.9, 0.8, 1.0)
    assert odds.middle([0, 1, 2]) == 2
    alone = Odds([entry("true")], own[2:, 2:], 0.9, 0.8, 1.0)
    assert odds.smallest(2)[0] > alone.smallest(0)[0]  # the shapes share the prior


def test_what_the_motion_does_not_show_has_no_size_and_stands_first() -> None:
    own = np.array([[1e-9]])
    assert Odds([entry("true")], own, 0.9, 0.8, 1.0).smallest(0)[0] == np.inf
    assert SIZES[-1] == 3.0

    def said(share: float) -> Smallest:
        return Smallest("a", (1,), "Fv1", "1", share, share, 1, "N·m", (), ("nothing", ()), share)

    assert [one.size for one in worst_first([said(0.1), said(np.inf), said(0.2)])] == [np.inf, 0.2, 0.1]


def test_shapes_of_a_candidate_are_summed_each_with_its_own() -> None:
    first, second = entry("first", candidate=None), entry("second", candidate=None)
    second.candidate.combinations = 4
    entries = [first, *[entry("several", candidate=second.candidate) for _ in range(3)], second]
    odds = Odds(entries, information(5, 1.0, 4), 0.9, 0.8, 1.0)
    nats = np.random.default_rng(5).normal(scale=500.0, size=(7, 5))
    expected = np.stack([nats[:, 0], logsumexp(nats[:, 1:], axis=1)], axis=1)
    np.testing.assert_allclose(odds._sums(nats), expected, rtol=1e-13)
    close = nats / 500.0
    expected = np.stack([close[:, 0], logsumexp(close[:, 1:], axis=1)], axis=1)
    np.testing.assert_allclose(odds._sums(close), expected, rtol=1e-13, atol=1e-13)


def test_recordings_that_judge_count_for_their_length(monkeypatch: pytest.MonkeyPatch) -> None:
    def lasting(seconds: float) -> Any:
        return SimpleNamespace(sample_time=0.004, time=np.arange(round(seconds / 0.004)))

    told: list[tuple[float, float]] = []
    for name in ("prepare", "predicted", "_as_asked", "_rows", "_vocabulary"):
        monkeypatch.setattr(planned, name, lambda *given: None)
    monkeypatch.setattr(
        planned, "smallest_sizes", lambda *given, judged: (told.append((given[4], judged)), ())[1]
    )
    model: Any = SimpleNamespace(
        base=SimpleNamespace(model=SimpleNamespace(robot=None)),
        prior=None,
        start=None,
        present=None,
        noise=(),
    )
    nothing: Any = SimpleNamespace(members=(), level=None)
    for judging, share in ((24.0, 0.4), (60.0, 1.0)):
        planned.sizes_beside(
            model,
            nothing,
            cast(Any, None),
            (),
            recordings=[lasting(60.0)],
            judging=[lasting(judging)],
            lag_known=True,
        )
        assert told.pop() == (SURE, pytest.approx(share))


def test_a_few_shapes_that_stand_for_all_have_the_prior_of_one_each() -> None:
    own = np.array([[100.0]])
    few, many = entry("true"), entry("true")
    many.candidate.combinations = 386
    small, large = (Odds([one], own, 0.9, 0.8, 1.0).smallest(0)[0] for one in (few, many))
    assert large > 1.1 * small


def test_what_the_fit_alone_has_to_show_is_larger() -> None:
    """The search goes on in the loop with what its rows alone are sure of."""
    own = np.array([[100.0]])
    usual, sure = (Odds([entry("true")], own, 0.9, 0.8, 1.0, by_fit).smallest(0)[0] for by_fit in (EVEN, 0.9))
    assert sure > 1.05 * usual


def of_values(values: list[float], information: list[float], rest: float = 0.3) -> tuple[Any, Odds]:
    """An effect that is what its first shape makes it, with some values of that and what each one shows."""
    shapes = (Shape("limit", "N·m", tuple(values), 1.0, 9.0), Shape("other", "1", (rest,), 0.0, 1.0))
    family = SimpleNamespace(essential=())
    candidate = SimpleNamespace(
        key=("saturation", (0,)), shapes=shapes, family=family, share=0.1, combinations=len(values)
    )
    entries = [entry("saturation", centre=1.0, candidate=candidate) for _ in values]
    for one, value, size in zip(entries, values, information, strict=True):
        one.placed = SimpleNamespace(
            whole=True, shape=(value, rest), shape_names=("limit", "other"), torque=np.sqrt(size)
        )
    rows: Any = SimpleNamespace(
        prepared=SimpleNamespace(
            robot=SimpleNamespace(joint=[SimpleNamespace(torque=10.0, torque_unit="N·m")]),
            used=np.ones((4, 1), dtype=np.bool_),
        ),
        thin=lambda placed: placed.torque * np.ones((4, 1, 1)),
    )
    return rows, Odds(entries, np.diag(information), 0.9, 0.8, 1.0)


def test_of_what_its_shape_makes_the_name_begins_between_two_values_that_are_asked_as_they_are() -> None:
    rows, odds = of_values([1.0, 2.0, 4.0, 8.0], [0.1, 1.0, 400.0, 900.0])
    said = _of_grid(rows, odds, [0, 1, 2, 3])
    assert 2.0 < said.size < 4.0 and 1.0 < said.torque < 20.0 and not said.falls
    assert said.shape == (("other", 0.3, "1"),) and said.parameter == "limit"
    assert said.names(4.0) and not said.names(2.0)


def test_of_a_limit_it_is_the_largest_that_would_be_named() -> None:
    rows, odds = of_values([1.0, 2.0, 4.0, 8.0], [900.0, 400.0, 1.0, 0.1])
    said = _of_grid(rows, odds, [0, 1, 2, 3])
    assert said.falls and 2.0 < said.size < 4.0
    assert said.names(2.0) and not said.names(4.0)
    better = replace(said, size=1.5 * said.size)
    assert better.tells_more_than(said) and not said.tells_more_than(better)


def test_values_that_all_show_or_none_end_the_grid() -> None:
    rows, odds = of_values([1.0, 2.0], [400.0, 900.0])
    assert _of_grid(rows, odds, [0, 1]).size == 1.0
    rows, odds = of_values([1.0, 2.0], [0.1, 1.0])
    none = _of_grid(rows, odds, [0, 1])
    assert not none.seen and not none.names(9.0) and not none.tells_more_than(none)
    assert replace(none, size=3.0).tells_more_than(none)


def test_of_an_effect_at_a_place_the_answer_is_the_less() -> None:
    def said(joint: int, size: float) -> Smallest:
        return Smallest("a", (joint,), "F", "1", size, size, 1, "N·m", (), ("nothing", ()), size)

    less = planned.or_less([said(1, np.inf), said(2, 0.1)], [said(1, 0.4), said(2, 0.4), said(3, np.inf)])
    assert [(one.joints, one.size) for one in less] == [((1,), 0.4), ((2,), 0.1), ((3,), np.inf)]
