"""The smallest size that would be named: by its formulas against drawn scores, and its limits."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.special import logsumexp

from ident.discrepancy.by_evidence.decide.screening import _alike
from ident.discrepancy.by_evidence.decide.state import ONE_MORE, TEMPERATURE
from ident.discrepancy.by_evidence.power import planned
from ident.discrepancy.by_evidence.power.expected import Expectation
from ident.discrepancy.by_evidence.power.smallest import SIZES, Smallest, _Odds, _said, least_of, worst_first
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
    own = candidate or SimpleNamespace(key=(name, (0,)), share=0.1, family=family)
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
    size, _ = _Odds(entries, own, 0.9, 0.8, judged).unlucky(0)
    assert named(own, size, entries, judged) == pytest.approx(0.8, abs=0.04)


def test_what_another_name_imitates_needs_to_be_larger_and_is_told_from_that_name() -> None:
    entries = [entry("true"), entry("other")]
    own = 100.0 * np.array([[1.0, 0.0], [0.0, 1.0]])
    apart, rival = _Odds(entries, own, 0.9, 0.8, 1.0).unlucky(0)
    assert rival == ("nothing", ())
    own = 100.0 * np.array([[1.0, 0.995], [0.995, 1.0]])
    near, rival = _Odds(entries, own, 0.9, 0.8, 1.0).unlucky(0)
    assert rival == ("other", (0,))
    assert near > 1.2 * apart
    assert named(own, near, entries) == pytest.approx(0.8, abs=0.04)
    own = 100.0 * np.ones((2, 2))
    assert _Odds(entries, own, 0.9, 0.8, 1.0).unlucky(0)[0] == np.inf


def test_a_rival_that_cannot_have_the_sign_is_none() -> None:
    """Both signs of the effect are asked about: one of them is told easily, the other is the answer."""
    own = 100.0 * np.array([[1.0, 0.995], [0.995, 1.0]])
    positive = entry("other", bounds=(0.0, np.inf))
    either = _Odds([entry("true"), positive], own, 0.9, 0.8, 1.0)
    falls = _Odds([entry("true", bounds=(-np.inf, 0.0)), positive], own, 0.9, 0.8, 1.0)
    rises = _Odds([entry("true", bounds=(0.0, np.inf)), positive], own, 0.9, 0.8, 1.0)
    assert falls.unlucky(0)[0] < rises.unlucky(0)[0] == either.unlucky(0)[0]


def test_of_several_shapes_the_one_in_the_middle_answers() -> None:
    shared = SimpleNamespace(key=("true", (0,)), share=0.1, family=SimpleNamespace(essential=()))
    entries = [entry("true", candidate=shared) for _ in range(3)]
    own = np.diag([400.0, 25.0, 100.0])
    odds = _Odds(entries, own, 0.9, 0.8, 1.0)
    assert odds.middle([0, 1, 2]) == 2
    alone = _Odds([entries[2]], own[2:, 2:], 0.9, 0.8, 1.0)
    assert odds.unlucky(2)[0] > alone.unlucky(0)[0]  # the shapes share the prior


def test_what_the_motion_does_not_show_has_no_size_and_stands_first() -> None:
    own = np.array([[1e-9]])
    assert _Odds([entry("true")], own, 0.9, 0.8, 1.0).unlucky(0)[0] == np.inf
    assert SIZES[-1] == 3.0

    def said(share: float) -> Smallest:
        return Smallest("a", (1,), "Fv1", "1", share, share, 1, "N·m", (), ("nothing", ()), share)

    assert [one.size for one in worst_first([said(0.1), said(np.inf), said(0.2)])] == [np.inf, 0.2, 0.1]


def test_shapes_of_a_candidate_are_summed_each_with_its_own() -> None:
    first, second = entry("first", candidate=None), entry("second", candidate=None)
    entries = [first, *[entry("several", candidate=second.candidate) for _ in range(3)], second]
    odds = _Odds(entries, information(5, 1.0, 4), 0.9, 0.8, 1.0)
    nats = np.random.default_rng(5).normal(scale=500.0, size=(7, 5))
    expected = np.stack([nats[:, 0], logsumexp(nats[:, 1:], axis=1)], axis=1)
    np.testing.assert_allclose(odds._sums(nats), expected, rtol=1e-13)
    close = nats / 500.0
    expected = np.stack([close[:, 0], logsumexp(close[:, 1:], axis=1)], axis=1)
    np.testing.assert_allclose(odds._sums(close), expected, rtol=1e-13, atol=1e-13)


def test_recordings_that_judge_count_for_their_length(monkeypatch: pytest.MonkeyPatch) -> None:
    def lasting(seconds: float) -> Any:
        return SimpleNamespace(sample_time=0.004, time=np.arange(round(seconds / 0.004)))

    told: list[float] = []
    for name in ("prepare", "predicted", "_as_asked", "_rows", "library"):
        monkeypatch.setattr(planned, name, lambda *given: None)
    monkeypatch.setattr(planned, "smallest_sizes", lambda *given, judged: (told.append(judged), ())[1])
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
        assert told.pop() == pytest.approx(share)


def test_a_size_that_is_a_shape_is_no_smaller_than_the_vocabulary_has() -> None:
    """A gear of 1.1e-6 rad/(N·m) was said to be named, where the stiffest that is looked for has 2.7e-6."""
    shape, other = (Shape("a", "1", (0.2, 0.4), lower, 0.8) for lower in (0.1, -0.1))
    assert (least_of(shape), least_of(other)) == (0.1, 0.0)
    placed = SimpleNamespace(whole=True, shape=(0.2,), shape_names=("compliance",))
    prepared: Any = SimpleNamespace(
        robot=SimpleNamespace(joint=[SimpleNamespace(torque=10.0, torque_unit="N·m")]),
        used=np.ones((4, 1), dtype=np.bool_),
        parts=(SimpleNamespace(columns=lambda placed: np.ones((4, 1, 1))),),
    )
    family = SimpleNamespace(essential=())
    candidate = SimpleNamespace(key=("joint_elasticity", (0,)), shapes=(shape,), family=family)
    one: Any = SimpleNamespace(placed=placed, candidate=candidate, white=SimpleNamespace(scale=np.ones(1)))
    for factor, size in ((0.01, 0.1), (0.5, 0.1), (0.75, 0.15), (np.inf, np.inf)):
        said = _said(cast(Any, SimpleNamespace(prepared=prepared)), one, factor, ("nothing", ()))
        assert said.size == pytest.approx(size)
