"""The evidence of the simulated loop: what shows at reversals has a name, and a clean arm has none."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from drivers.simulated.scenario import Scenario
from ident.discrepancy.by_evidence import in_loop as in_loop_module
from ident.discrepancy.by_evidence import reversals
from ident.discrepancy.by_evidence.decide.left_over import torque_of
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.by_evidence.evidence.loop_rows import LoopRows
from ident.discrepancy.by_evidence.in_loop import InLoop
from ident.discrepancy.by_evidence.reversals import likeliest_in_loop, posed_in_loop
from ident.discrepancy.step import LoopStep
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from ident.errors import IdentificationError
from tests.ident.discrepancy.blind_search import hidden
from tests.ident.discrepancy.by_evidence.reversal_search import FAMILIES, Course, in_loop, looked, looking

FALLING = [family_named("stribeck_friction")]


@pytest.fixture(scope="module")
def falling() -> LoopStep:
    return in_loop(hidden({"stribeck_friction": [{"drive": 1, "rise": 3.0, "speed": 0.01}]}))


def test_friction_that_falls_with_speed_is_named_at_its_drive(falling: LoopStep) -> None:
    found = likeliest_in_loop(posed_in_loop(falling), FAMILIES, set(), {0})
    assert found is not None
    assert found.key == ("stribeck_friction", (0,))
    assert found.names.probability(found.key) > 0.9
    assert found.names.log_odds(found.key) == pytest.approx(
        max(one.log_odds for one in found.names.names), abs=1e-9
    )


@pytest.mark.parametrize(("usual", "odds"), [(1.0, 0.1), (200.0, 0.1), (1000.0, 1.0)])
def test_something_without_a_name_is_as_likely_as_what_explains_no_more_than_every_arm_leaves(
    falling: LoopStep, usual: float, odds: float
) -> None:
    """By what the simulated loop makes of it: its torque in the rows is that of a fall, which lags behind."""
    problem = posed_in_loop(falling)
    misfit = replace(problem.misfit, accepted=usual * problem.misfit.accepted)
    found = likeliest_in_loop(replace(problem, misfit=misfit), FALLING, set(), {0})
    assert found is not None
    nameless = found.names.probability((NO_NAME, (0,)))
    assert nameless / found.names.probability(found.key) == pytest.approx(odds, rel=0.02)


@pytest.mark.parametrize(
    ("name", "drive", "size", "odds"),
    [
        ("coulomb_friction", 0, 90.0, 1.0),
        ("coulomb_friction", 0, 0.03, 0.1),
        ("coulomb_friction", 1, 90.0, 0.1),
        ("viscous_friction", 0, 9000.0, 0.1),
        ("current_offset", 0, 90.0, 0.1),
    ],
)
def test_how_a_friction_that_motion_has_shown_turns_its_sign_is_not_told_from_another_as_large(
    falling: LoopStep, name: str, drive: int, size: float, odds: float
) -> None:
    """Of a friction of the load that a loop turned as the rest a static friction was named at its drive.

    And beside a friction that changes by 0.5 N·m over the way one of 2.9 N·m was not.
    """
    place = Place("drive", (0,))
    effect: Any = family_named(name).effect(falling.base.model.robot, place, (), falling.present)
    beside = [(replace(effect, place=Place("drive", (drive,))), np.array([size]))]
    found = likeliest_in_loop(posed_in_loop(falling), FALLING, set(), {0}, beside)
    assert found is not None and found.key == ("stribeck_friction", (0,))
    nameless = found.names.probability((NO_NAME, (0,)))
    assert nameless / found.names.probability(found.key) == pytest.approx(odds, rel=0.02)


def test_what_only_the_end_of_a_motion_presses_against_is_found_there() -> None:
    """The axis turns round 4 mm behind it, so hardly a moving row is there, and no place of a grid."""
    ends_at = 0.0788
    step = in_loop(
        hidden({"contact": [{"joint": 1, "upper": ends_at - 4e-3, "stiffness": 500.0, "damping": 0.0}]})
    )
    families = [*FALLING, family_named("contact")]
    found = likeliest_in_loop(posed_in_loop(step), families, set(), {0})
    assert found is not None and found.key == ("contact", (0,))
    assert found.placed.shape == pytest.approx((ends_at - 4e-3, 1.0), abs=2e-4)
    assert found.names.probability(found.key) > 0.9


def test_torque_at_reversals_is_that_of_the_simulated_loop(falling: LoopStep) -> None:
    problem = posed_in_loop(falling)
    rows = cast(LoopRows, problem.rows).exactly()
    robot, place = falling.base.model.robot, Place("drive", (0,))
    placed = family_named("hysteresis").effect(robot, place, (0.003,), falling.present)
    answer = rows.loop.respond(placed)
    assert answer is not None
    found: Any = SimpleNamespace(
        members=[SimpleNamespace(entry=SimpleNamespace(placed=placed))],
        theta=lambda _: (np.array([2.0]), None),
    )
    squares = np.where(problem.prepared.used, 2.0 * answer[:, :, 0], 0.0) ** 2
    expected = np.sqrt(squares.sum(axis=0) / problem.prepared.used.sum(axis=0))
    assert torque_of(replace(problem, rows=rows), found, 0) == pytest.approx(expected)


def test_what_was_found_is_no_further_effect(falling: LoopStep) -> None:
    found = likeliest_in_loop(posed_in_loop(falling), FAMILIES, {("stribeck_friction", (0,))}, {0})
    assert found is None or found.key != ("stribeck_friction", (0,))


def test_rows_of_effects_that_are_simulated_are_the_same_rows(falling: LoopStep) -> None:
    rows = cast(LoopRows, posed_in_loop(falling).rows)
    exact = rows.exactly()
    robot, place = falling.base.model.robot, Place("drive", (0,))
    placed = family_named("hysteresis").effect(robot, place, (0.003,), falling.present)
    assert exact.white is rows.white and exact.products is rows.products
    assert not rows.exact and not np.allclose(rows.thin(placed), exact.thin(placed), rtol=0.01)
    assert exact.thin(placed) == pytest.approx(rows.loop.respond(placed), rel=1e-12)


@pytest.mark.parametrize(("most", "first"), [(1, 1), (3, 5), (10, 9)])
def test_as_many_are_simulated_as_there_are_leaders(
    most: int, first: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(reversals, "LEADERS", most)

    def simulated(problem: Any, empty: Any, one: str, present: Any) -> str:
        asked.append(one)
        return one

    monkeypatch.setattr(reversals, "_simulated", simulated)
    nobody: Any = None
    leaders: Any = set()
    order: Any = list("aabacadbc")
    found = []
    for one, fitted in reversals._with_leaders(nobody, nobody, order, nobody, leaders):
        found.append((one, fitted))
        leaders.add(one)
    assert sorted(asked) == sorted(order[:first])
    assert found == [(one, one if k < first else None) for k, one in enumerate(order)]


def test_what_shows_at_reversals_alone_is_simulated_with_the_shape_that_acts_for_the_shortest_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """No columns of rows say how likely it is: it takes no leader's place."""
    monkeypatch.setattr(reversals, "LEADERS", 0)
    late = in_loop(hidden({"static_friction": [{"drive": 1, "rise": 3.0, "speed": 0.001}]}))
    found = likeliest_in_loop(posed_in_loop(late), FAMILIES, set(), {0})
    assert found is not None and found.key == ("static_friction", (0,))


@pytest.fixture(scope="module")
def clean() -> LoopStep:
    return in_loop(Scenario())


def test_a_clean_arm_has_no_name_and_its_loop_leaves_noise(clean: LoopStep) -> None:
    problem = posed_in_loop(clean)
    rows = problem.rows
    assert likeliest_in_loop(problem, FAMILIES, set(), {0}) is None
    assert problem.level.excess.max() < 1.2
    assert problem.level.kappa.max() < 0.5 * max(one.marginal for one in rows.noise)
    at_rest = ~rows.prepared.used
    assert np.isfinite(rows.known.columns).all() and at_rest.any()


def test_what_the_loop_shows_is_added_with_its_probability(falling: LoopStep) -> None:
    search = looked(falling, "clean", set())
    ((name, probability),) = search.course.taken
    assert name == "stribeck_friction"
    assert probability > 0.9
    assert search.course.step is falling and search.course.reversing is falling
    assert not search.unnamed


@pytest.mark.parametrize("moving", ["clean", "unnamed"])
def test_a_loop_that_does_otherwise_without_a_name_is_told(falling: LoopStep, moving: str) -> None:
    search = looked(falling, moving, {0})
    assert not search.course.taken
    assert search.course.reversing is None
    assert ("at joint 1" in search.unnamed) is (moving == "clean")


@pytest.mark.parametrize(("findings", "told"), [((), True), (("payload",), False)])
def test_a_loop_whose_finding_has_gone_again_is_told(
    falling: LoopStep, findings: tuple[str, ...], told: bool
) -> None:
    search = looked(falling, "clean", set())
    search.look_again(findings)
    assert ("at joint 1" in search.unnamed) is told


def test_a_loop_that_no_arm_has_is_left_alone(monkeypatch: pytest.MonkeyPatch, falling: LoopStep) -> None:
    def refuse(step: LoopStep) -> None:
        raise IdentificationError("the gear of drive 1 has a gap of less than nothing")

    monkeypatch.setattr(in_loop_module, "posed_in_loop", refuse)
    search = looked(falling, "clean", set())
    assert search.course.reversing is None and not search.course.taken and not search.unnamed


def test_what_the_loop_cannot_be_simulated_with_is_not_added(
    monkeypatch: pytest.MonkeyPatch, falling: LoopStep
) -> None:
    """A gear that stiffened beside an elastic one ran away in its first step, and there was no diagnosis."""

    def refuse(course: Course, in_loop: Any, component: Any, basis: Any) -> None:
        raise IdentificationError("the simulated loop is unstable")

    monkeypatch.setattr(Course, "add_in_loop", refuse)
    search = looking(falling)
    moving = search.course.step
    search.look()
    assert search.course.step is moving and search.course.reversing is None
    assert not search.course.taken and not search.unnamed


def test_a_clean_loop_is_told_of_nothing(clean: LoopStep) -> None:
    search = looked(clean, "clean", {0})
    assert not search.course.taken and not search.unnamed


def test_another_joint_has_no_part_in_it(falling: LoopStep) -> None:
    assert likeliest_in_loop(posed_in_loop(falling), FAMILIES, set(), {1}) is None


def test_no_look_beside_three_findings_nor_where_something_does_not_repeat(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kinds: list[str] = []
    monkeypatch.setattr(
        in_loop_module, "unrepeated", lambda *_: [SimpleNamespace(kind=kind) for kind in kinds]
    )
    nobody: Any = None
    for count, does_not_repeat, worth in (
        (2, [], True),
        (3, [], False),
        (0, ["shocks"], True),
        (0, ["shocks", "bursts"], False),
    ):
        kinds[:] = does_not_repeat
        course: Any = SimpleNamespace(
            findings=[nobody] * count,
            step=SimpleNamespace(examination=None),
            prepared=[SimpleNamespace(row_time=0.008)],
        )
        assert InLoop(course, nobody, ()).is_worth_a_look() is worth


def test_a_joint_that_is_not_told_or_leaves_much_in_motion_is_left_alone() -> None:
    """More than an accepted model leaves: of one of three joints that is likely, of another it may be."""
    one = SimpleNamespace(joints=(3,), indistinguishable_from=())
    misfits = [SimpleNamespace(joint=k, above=above) for k, above in ((1, 0.11), (3, 0.0), (2, 0.09))]
    answer: Any = SimpleNamespace(joints=misfits)
    course: Any = SimpleNamespace(findings=[one])
    search = InLoop(course, answer, ())
    assert search.left_alone() == {0}
    one.indistinguishable_from = (SimpleNamespace(joints=(3,)),)
    assert search.left_alone() == {0, 2}
    course.findings = []
    assert search.left_alone() == set()
