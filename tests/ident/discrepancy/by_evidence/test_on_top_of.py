"""What is a rise of another effect is in no set without it, unless the model has that."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

import robots
from ident import RegressorModel
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.search import Search
from ident.discrepancy.by_evidence.decide.state import stands
from ident.discrepancy.by_evidence.library.candidates import Entry, candidates
from ident.effects.family import PresentModel
from ident.effects.usual import SYMBOLS
from ident.effects.vocabulary import VOCABULARY, family_named
from ident.parameters.present import Present
from tests.ident.discrepancy.by_evidence.toy_effects import names_of, problem_of, searching, torque, waves


def rises(of: str, own: float) -> Search:
    """A search whose truth is a rise of so much beside its ground, in which the rise alone would do as well.

    Args:
        of: what the rise is on top of.
        own: N, of the rise, beside 2 N of the ground.
    """
    fall = replace(waves("fall", w9=1.0, w11=0.5), on_top_of=(of,))
    hidden = problem_of(lambda q: torque(q, w9=2.0 + own, w11=0.5 * own))
    return searching(hidden, [waves("ground", w9=1.0), fall])


def test_a_rise_is_found_beside_what_it_is_a_rise_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone it would be nearer to the truth than its ground alone."""
    monkeypatch.setitem(SYMBOLS, "ground", ("Fg",))
    search = rises("ground", 2.0)
    searched = search.run()
    assert names_of(searched) == ["fall", "ground"]
    keys = [member.candidate.key[0] for member in searched.found.members]
    assert search.without(searched.found, keys.index("ground")).members == ()
    (kept,) = search.without(searched.found, keys.index("fall")).members
    assert kept.candidate.key[0] == "ground"
    assert frozenset([("fall", (0,))]) not in search.visited


def test_a_rise_of_what_the_model_has_stands_alone() -> None:
    search = rises("coulomb_friction", 2.0)
    search.run()
    assert frozenset([("fall", (0,))]) in search.visited


def test_what_an_effect_is_on_top_of_is_a_usual_term() -> None:
    forms = [form for family in VOCABULARY for form in family.nested]
    assert {name for form in forms for name in form.on_top_of} == {"coulomb_friction"} <= set(SYMBOLS)


@pytest.mark.parametrize(
    ("name", "drive", "model_couples", "found", "expected"),
    [
        ("nonlinear_viscous_friction", 5, False, "", False),
        ("nonlinear_viscous_friction", 5, False, "wrist_coupling", True),
        ("nonlinear_viscous_friction", 5, True, "", True),
        ("nonlinear_viscous_friction", 4, False, "", True),
        ("torque_ripple", 5, False, "", True),
    ],
)
def test_friction_of_a_drive_that_moves_two_joints_goes_with_both(
    name: str, drive: int, model_couples: bool, found: str, expected: bool
) -> None:
    """A power of the speed of drive 6 of a TX40 had the place of the coupling that its model lacked."""
    robot = robots.load("tx40")
    usual = RegressorModel.of(robot)
    kept = tuple(one for one in usual.effects if model_couples or one.name != "wrist_coupling")
    model = RegressorModel(robot, kept)
    present: PresentModel = Present(model, model.prior())
    one = next(one for one in candidates(robot, [family_named(name)]) if one.place.joints == (drive,))
    placed = one.at(robot, tuple(shape.grid[0] for shape in one.shapes), present)
    problem: Any = SimpleNamespace(base=SimpleNamespace(model=model), present=present)
    problem.uncoupled = Problem.uncoupled.func(problem)
    white: Any = None
    members: Any = [SimpleNamespace(candidate=SimpleNamespace(key=(found, (4, 5))))]
    assert stands(problem, Entry(one, placed, white), members) is expected
