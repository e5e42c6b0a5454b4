"""Links behind several soft gears at once: found by what their springs carry, and fitted as one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robots
from drivers.simulated.scenario import Scenario
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import prior_by_evidence
from ident.discrepancy.by_evidence.decide.as_one import as_one, part_of
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.search import Search
from ident.discrepancy.by_evidence.decide.shapes_at_once import shapes_at_once
from ident.discrepancy.by_evidence.decide.soft_places import SoftPlaces
from ident.discrepancy.by_evidence.decide.state import Found, found_set, without_effects
from ident.discrepancy.by_evidence.library.candidates import Entry, candidates, library
from ident.discrepancy.by_evidence.workflow import posed
from ident.effects.elastic_gear import link_inertia
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import hidden, recorded

pytestmark = pytest.mark.slow

ROBOT, TRUTH, DURATION = robots.load("tx40"), 78, 5.0
HZ = {2: 5.0, 3: 7.0}
"""Of the links behind each soft gear, the rest of the arm rigid."""
STIFFNESS = {drive: link_inertia(ROBOT, drive - 1) * (2.0 * np.pi * hz) ** 2 for drive, hz in HZ.items()}


@cache
def problem(*drives: int) -> tuple[Problem, tuple[Entry, ...]]:
    """An arm with such gears soft, and the vocabulary of soft gears and feet."""
    soft = [{"drive": drive, "stiffness": STIFFNESS[drive]} for drive in drives]
    scenario = hidden({"joint_elasticity": soft}) if soft else Scenario()
    accepted = recorded(ROBOT, TRUTH, Scenario(), 0, 1, DURATION)
    fit, validation = (recorded(ROBOT, TRUTH, scenario, k, k + 2, DURATION) for k in (0, 1))
    families = tuple(family_named(one) for one in ("joint_elasticity", "base_compliance"))
    question = Question(
        ROBOT, (fit,), (validation,), families, lambda base: prior_by_evidence(base, (accepted,))
    )
    made = posed(question)
    wanted = candidates(made.prepared.robot, families)
    return made, library(made.rows, wanted, present_with(made, without_effects(made)))


def both() -> Found:
    """The set that soft gears of drives 2 and 3 are found in."""
    made, entries = problem(2, 3)
    empty = without_effects(made)
    (found,) = SoftPlaces(made).beside(empty, entries, present_with(made, empty))
    return found


def compliances(found: Found) -> dict[int, float]:
    """Over the true ones, by drive."""
    return {
        one.joints[0] + 1: one.entry.placed.shape[0] * STIFFNESS[one.joints[0] + 1] for one in found.members
    }


def test_two_soft_gears_are_found_at_once() -> None:
    """And the search that goes on from there ends with these two."""
    found = both()
    assert compliances(found) == {2: pytest.approx(1.0, rel=0.05), 3: pytest.approx(1.0, rel=0.05)}
    made, entries = problem(2, 3)
    wanted = tuple(dict.fromkeys(one.candidate for one in entries))
    ended = Search(made, wanted, lambda step, share: None).run().found
    assert set(compliances(ended)) == {2, 3} and ended.log_posterior >= found.log_posterior - 1.0


@pytest.mark.parametrize("drives", [(), (3,)])
def test_no_second_place_where_there_is_none(drives: tuple[int, ...]) -> None:
    made, entries = problem(*drives)
    wanted = tuple(dict.fromkeys(one.candidate for one in entries))
    ended = Search(made, wanted, lambda step, share: None).run().found
    assert set(compliances(ended)) == set(drives)


def test_columns_that_were_made_beside_other_shapes_are_made_anew() -> None:
    """Each knows what it makes of the others' ways: of shapes that changed both ways it is there twice."""
    made, _ = problem(2, 3)
    found = both()
    stale = found
    for number, factor in ((0, 1.1), (1, 0.9), (0, 1.0 / 1.1), (1, 1.0 / 0.9)):
        member = stale.members[number]
        softness, damping = member.entry.placed.shape
        placed = member.candidate.at(
            made.prepared.robot, (factor * softness, damping), present_with(made, stale, but=number)
        )
        entry = replace(member.entry, placed=placed, white=made.rows.effect(placed))
        members = [
            replace(member, entry=entry) if k == number else one for k, one in enumerate(stale.members)
        ]
        stale = found_set(made, members, found.level, ())
    assert stale.score < found.score - 50.0
    assert as_one(made, stale).score == pytest.approx(found.score, abs=1.0)


def test_one_that_is_left_is_not_beside_the_other_any_more() -> None:
    made, _ = problem(2, 3)
    found = both()
    alone = part_of(made, found, found.members[:1])
    kind, shape = alone.members[0].candidate, alone.members[0].entry.placed.shape
    present = present_with(made, alone, but=0)
    own = made.rows.thin(kind.at(made.prepared.robot, shape, present))
    beside, left = (made.rows.thin(one.members[0].entry.placed) - own for one in (found, alone))
    assert left.std() < 0.1 * own.std() < beside.std()


def test_shapes_are_fitted_at_once() -> None:
    """From 5 % away on both, which is several times as far as a resonance is wide."""
    made, _ = problem(2, 3)
    found = both()
    members = []
    for number, (member, factor) in enumerate(zip(found.members, (1.05, 0.95), strict=True)):
        softness, damping = member.entry.placed.shape
        placed = member.candidate.at(
            made.prepared.robot, (factor * softness, damping), present_with(made, found, but=number)
        )
        members.append(
            replace(member, entry=replace(member.entry, placed=placed, white=made.rows.effect(placed)))
        )
    begun = as_one(made, found_set(made, members, found.level, range(made.rows.n)))
    fitted = shapes_at_once(made, begun, [0, 1])
    assert fitted.score > begun.score + 50.0
    assert fitted.score == pytest.approx(found.score, abs=3.0)
