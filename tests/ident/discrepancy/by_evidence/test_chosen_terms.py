"""Which terms are chosen: of two neither need be best alone, and the simplest of what is not told apart."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide.state import TEMPERATURE
from ident.discrepancy.by_evidence.evidence.gram import Level
from ident.discrepancy.by_evidence.terms import chosen, propose, stability

VARIABLES = [{"v1"}, {"q1"}, {"v1"}, {"q1", "v1"}]
TERMS: list[Any] = [SimpleNamespace(variables=frozenset(one)) for one in VARIABLES]
LEVEL = Level(np.array([8.0]), np.array([4.0]))
FOUND: Any = SimpleNamespace(log_posterior=0.0, level=LEVEL, members=())
PROBLEM: Any = SimpleNamespace(misfit=SimpleNamespace(accepted=np.array([2.0])))


def choose(monkeypatch: pytest.MonkeyPatch, values: dict[chosen.Terms, float]) -> list[chosen.Terms]:
    """Which are chosen where sets of terms have these log posteriors over that of none."""
    monkeypatch.setattr(chosen, "_best", lambda *given: list(values))
    monkeypatch.setattr(
        chosen,
        "_with_terms",
        lambda problem, found, entries, starts, joint: SimpleNamespace(log_posterior=values[tuple(entries)]),
    )
    choices = chosen.chosen_terms(PROBLEM, FOUND, [0, 1, 2, 3], TERMS, 0, 4)  # type: ignore[list-item]
    return [which for which, _ in choices]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({(0,): 2.1}, []),  # nine to one against none is 2.2
        ({(0,): 2.3}, [(0,)]),
        ({(1,): 20.0, (0, 2): 21.0}, [(1,)]),  # a second term is as sure as the first
        ({(1,): 20.0, (0, 2): 23.0}, [(0, 2), (1,)]),  # and neither need be the best alone
        ({(1,): 1.0, (0, 2): 9.0}, [(0, 2)]),  # nor sure alone
        ({(3,): 20.0, (0,): 17.2}, [(0,)]),  # nineteen to one is 2.94: one variable does
        ({(3,): 20.0, (0,): 17.0}, [(3,)]),
        ({(0,): 20.0, (2,): 21.0}, [(2,)]),  # of equally many variables the likelier
    ],
)
def test_terms_are_as_sure_as_names_and_as_simple_as_the_data_allow(
    monkeypatch: pytest.MonkeyPatch, values: dict[chosen.Terms, float], expected: list[chosen.Terms]
) -> None:
    assert choose(monkeypatch, values) == expected


def test_terms_are_compared_from_the_misfit_without_them_down_to_the_accepted_one() -> None:
    levels = chosen._levels(PROBLEM, FOUND, 0)
    assert [float(one.kappa[0]) for one in levels] == pytest.approx([8.0, 4.0, 2.0])
    assert [float(one.excess[0]) for one in levels] == pytest.approx([4.0, 2.0, 1.0])


def test_the_best_pair_is_found_though_neither_is_the_best_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """y = a + b, of which c is nearly the sum; gains are those of whole systems."""
    random = np.random.default_rng(2)
    a, b = random.normal(size=(2, 400))
    columns = np.column_stack([a, b, a + b + 0.3 * random.normal(size=400), random.normal(size=400)])
    target = a + b
    own, score = columns.T @ columns, columns.T @ target
    monkeypatch.setattr(chosen, "information_beside", lambda *given: (own, score))
    monkeypatch.setattr(chosen, "Member", lambda entry, volume: SimpleNamespace(log_prior=-1.0))
    problem: Any = SimpleNamespace(rows=None)
    best = chosen._best(problem, FOUND, [0, 1, 2, 3], LEVEL, 1)  # type: ignore[list-item]
    assert best == [(2,), (0, 1)]

    def gain(which: list[int]) -> float:
        system = np.eye(len(which)) + own[np.ix_(which, which)]
        inverse = np.linalg.solve(system, score[which])
        return float(0.5 * score[which] @ inverse - 0.5 * np.linalg.slogdet(system)[1])

    assert chosen._gain_of_one(np.diag(own), score)[2] == pytest.approx(gain([2]))
    pair = chosen._gain_of_two(own, score, np.array([0]), np.array([1]))
    assert pair[0] == pytest.approx(gain([0, 1]))
    assert TEMPERATURE * pair[0] > TEMPERATURE * gain([2]) + 1.0


@pytest.mark.parametrize(("half", "same"), [([1.0, 0.0], True), ([0.0, 1.0], True), ([0.0, 0.0], False)])
def test_a_half_that_chose_another_name_for_the_same_torque_agrees(half: list[float], same: bool) -> None:
    """Two columns that are nearly one: their factors may stand for each other."""
    metric = 1e3 * np.array([[1.0, 0.999], [0.999, 1.0]])
    assert stability._same_torque(metric, np.array([1.0, 0.0]), np.array(half), 1) is same


def test_a_torque_is_the_same_up_to_three_tenths_and_what_chance_makes() -> None:
    metric, whole = np.array([[1e4]]), np.array([1.0])
    assert stability._same_torque(metric, whole, np.array([0.71]), 1)
    assert not stability._same_torque(metric, whole, np.array([0.69]), 1)
    # Of 3 deviations a half may lack two: 95 % of chance is 3.84 in squares, and 0.3 of the whole.
    weak = np.array([[9.0]])
    assert stability._same_torque(weak, whole, np.array([0.3]), 1)
    assert not stability._same_torque(weak, whole, np.array([0.2]), 1)


def test_one_term_is_told_where_two_are_not_stable(monkeypatch: pytest.MonkeyPatch) -> None:
    """What rows of one recording add to a term that holds takes nothing from it."""
    terms = [
        SimpleNamespace(joint=0, formula=f, unit="N", variables={"v1"}, looks_like="") for f in ("a", "b")
    ]
    fit: Any = SimpleNamespace(members=(), theta=lambda number: (np.ones(1), np.eye(1)))
    monkeypatch.setattr(propose, "_entries", lambda *given: (terms, ()))
    monkeypatch.setattr(propose, "chosen_terms", lambda *given: [((0, 1), fit), ((0,), fit)])
    monkeypatch.setattr(propose, "stability", lambda *given: 0.9 if given[4][0] == (0,) else 0.3)
    lefts = iter(np.array([[0.2], [0.01], [0.2], [0.02]]))
    held: Any = SimpleNamespace(unexplained=lambda found: next(lefts))
    (told,) = propose._of_joint(None, fit, None, held, 0)  # type: ignore[arg-type]
    assert (told.formula, told.stability, told.after) == ("a", 0.9, 0.02)
