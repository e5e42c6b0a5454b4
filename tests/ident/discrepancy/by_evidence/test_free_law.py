"""One law of the speed without a name, in the place of names that describe it together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import robots
from ident.discrepancy.by_evidence.decide.free_law import _KNOTS, _directions, free_law
from ident.discrepancy.by_evidence.decide.names import slot
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.library.candidates import is_law_of_speed
from ident.effects.placed import Placed
from ident.effects.vocabulary import VOCABULARY, family_named
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from tests.ident.discrepancy.by_evidence.toy_effects import RATE, NotLookedAt, problem_of, searching

LAWS = ("stribeck_friction", "nonlinear_viscous_friction")
FASTEST = 0.0785
"""m/s, that the axis of the toy effects comes to."""

Course = Callable[[np.ndarray], np.ndarray]


def eddy(share: np.ndarray) -> np.ndarray:
    """An eddy-current brake, strongest at half the fastest speed."""
    x = share / 0.5
    return np.asarray(100.0 * 2.0 * x / (1.0 + x * x))


def of_two_names(share: np.ndarray) -> np.ndarray:
    """Friction that falls with speed, and some that grows with a power of it."""
    falls, grows = np.exp(-((share / 0.15) ** 2)), np.abs(share) ** 0.3
    return np.asarray(np.sign(share) * (40.0 * falls + 100.0 * grows))


def of_a_power(share: np.ndarray) -> np.ndarray:
    return np.asarray(np.sign(share) * 100.0 * np.abs(share) ** 0.3)


def searched_for(course: Course, names: tuple[str, ...] = LAWS) -> tuple[Search, Searched]:
    def more(position: np.ndarray) -> np.ndarray:
        return course(np.gradient(position) * RATE / FASTEST)

    search = searching(problem_of(more), [family_named(name) for name in names])
    return search, search.run()


@pytest.mark.parametrize(("course", "has_a_name"), [(eddy, False), (of_two_names, True)])
def test_several_names_of_one_law_are_as_likely_as_a_law_without_one_says(
    course: Course, has_a_name: bool
) -> None:
    search, searched = searched_for(course)
    found = searched.found
    assert {one.candidate.family.name for one in found.members} == set(LAWS)
    odds = free_law(search.problem, searched, 0)
    assert (odds < -3.0) if has_a_name else (odds > 3.0)
    for number, member in enumerate(found.members):
        held = NotLookedAt()
        said = slot(search, searched, number, search.without(found, number), held)
        unknown = said.probability((NO_NAME, member.candidate.key[1]))
        assert (unknown < 0.1) if has_a_name else (unknown > 0.9)


def test_what_is_less_than_an_accepted_model_leaves_is_no_law_of_its_own() -> None:
    """A friction that falls and one that grows with the square, of shapes a little wrong: 0.04 N left."""

    def nearly(share: np.ndarray) -> np.ndarray:
        return np.asarray(np.sign(share) * (15.0 * np.exp(-np.abs(share) / 0.25) + 40.0 * share**2))

    search, searched = searched_for(nearly)
    left = float(searched.found.level.kappa[0])

    def odds(usual: float) -> float:
        misfit = replace(search.problem.misfit, accepted=np.array([usual]))
        return free_law(replace(search.problem, misfit=misfit), searched, 0)

    assert 0.02 < left < 0.1 and odds(0.1 * left) > 10.0 and odds(left) < 0.0


@pytest.mark.parametrize(("course", "has_a_name"), [(eddy, False), (of_a_power, True)])
def test_one_name_is_as_likely_as_a_law_without_one_says(course: Course, has_a_name: bool) -> None:
    """An eddy-current brake was a power of the speed, 0.96, though its form was far off."""
    search, searched = searched_for(course, LAWS[1:])
    assert len(searched.found.members) == 1
    odds = free_law(search.problem, searched, 0)
    assert (odds < -3.0) if has_a_name else (odds > 3.0)


def test_what_is_no_law_of_the_speed_has_none_in_its_place() -> None:
    search, searched = searched_for(of_a_power, ("position_dependent_friction",))
    assert [free_law(search.problem, searched, k) for k in range(len(searched.found.members))] == [-np.inf]


def test_a_free_law_is_smooth_over_the_logarithm_of_the_speed() -> None:
    """A factor of e is as far as it knows itself; few directions hold all of it."""
    directions = _directions()
    covariance = directions @ directions.T
    apart = np.log(_KNOTS)[:, np.newaxis] - np.log(_KNOTS)
    assert covariance == pytest.approx(np.exp(-0.5 * apart**2), abs=2e-3)
    assert np.abs(covariance - np.exp(-0.5 * apart**2)).max() > 1e-4 and directions.shape[1] == 10


def test_what_follows_the_speed_and_nothing_else_is_a_law_of_it() -> None:
    robot = robots.load("tx40")
    present = Present(RegressorModel.of(robot), RegressorModel.of(robot).prior())
    laws = set()
    for family in VOCABULARY:
        for form in family.nested:
            place = next(iter(form.places(robot)), None)
            if place is None:
                continue
            shape = tuple(one.grid[0] for one in form.shapes(robot, place))
            effect = form.effect(robot, place, shape, present)
            assert isinstance(effect, Placed)
            if is_law_of_speed(form, effect):
                laws.add(family.name)
    assert laws >= {"viscous_friction", "coulomb_friction", *LAWS}
    assert laws.isdisjoint({"hysteresis", "static_friction", "load_dependent_friction", "dragging_brake"})
    assert laws.isdisjoint(
        {"position_dependent_friction", "drifting_friction", "asymmetric_friction", "payload"}
    )
