"""Two sets that fit the recordings alike: do they say the same of motion all over the travel?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import robots
from ident.discrepancy.by_evidence.decide.elsewhere import Elsewhere, all_over, cut, within
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.state import Found, without_effects
from ident.discrepancy.by_evidence.library.candidates import library
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.toy_effects import (
    REACH,
    family,
    problem_of,
    searching,
    torque,
    wave,
)


def spring(beyond: float) -> Callable[[FloatArray, object], FloatArray]:
    """Waves, and so many N more at twice the way that the recording covers; nothing within it."""
    return lambda q, shape: wave(9, q) + beyond * np.maximum(np.abs(q) / REACH - 1.01, 0.0)


def test_what_the_recordings_do_not_show_makes_two_sets_of_other_motion() -> None:
    families = [family("limit", spring(0.0)), family("same", spring(0.0)), family("more", spring(5.0))]
    search = searching(problem_of(lambda q: torque(q, w9=2.0)), families)
    empty = without_effects(search.problem)
    present = present_with(search.problem, empty)
    entries = library(search.problem.rows, search.wanted, present)
    fitted: dict[str, Found] = {}
    for one in screen(search.problem, empty, entries):
        (fitted[one.candidate.family.name],) = search.replaced(empty, [one])
    assert fitted["more"].log_evidence == pytest.approx(fitted["limit"].log_evidence, abs=0.1)
    assert search.elsewhere.same(fitted["same"], fitted["limit"])
    assert not search.elsewhere.same(fitted["more"], fitted["limit"])
    assert not search.elsewhere.same(fitted["limit"], empty)


def test_motion_is_asked_about_at_the_time_of_the_recordings() -> None:
    """What begins later than they end is no difference that a motion makes."""
    problem = problem_of(lambda q: torque(q, w9=2.0))
    (part,) = problem.prepared.parts
    assert part.own.time is not None
    elsewhere = Elsewhere.of(problem)
    times = [piece.own.time for piece in elsewhere.prepared.parts]
    assert len(times) == 2 and all(time is not None and time[-1] <= part.own.time[-1] for time in times)
    whole = all_over(problem.prepared.robot, part.sample_time)
    pieces = cut(whole, 7.0)
    assert [piece.time[0] for piece in pieces] == [0.0] * 4
    assert np.concatenate([piece.position for piece in pieces]) == pytest.approx(whole.position)
    (one,) = cut(whole, 30.0)
    assert one.time == pytest.approx(whole.time)


def test_a_torque_below_the_accepted_misfit_makes_no_difference() -> None:
    problem = problem_of(lambda q: torque(q, w9=2.0))
    search = searching(problem, [family("limit", spring(0.0)), family("more", spring(1.0))])
    empty = without_effects(problem)
    entries = library(problem.rows, search.wanted, present_with(problem, empty))
    one, other = (search.replaced(empty, [each])[0] for each in screen(problem, empty, entries))
    elsewhere = Elsewhere.of(problem)
    (size,) = elsewhere.lacking(one, other)
    assert size > 0.0
    for share, same in ((1.1, True), (0.9, False)):
        problem.misfit.accepted[:] = share * size
        assert elsewhere.same(one, other) is same


def test_what_two_fits_are_not_sure_of_is_no_difference_of_names() -> None:
    """A form that says what a limit of another size says, within its 95 %, has no more than a limit."""
    problem = problem_of(lambda q: torque(q, w9=2.0))
    search = searching(problem, [family("limit", spring(0.0))])
    empty = without_effects(problem)
    entries = library(problem.rows, search.wanted, present_with(problem, empty))
    (limit,) = search.replaced(empty, screen(problem, empty, entries))
    deviation = np.sqrt(limit.posterior.covariance[-1, -1])
    columns = search.elsewhere._columns(limit)[search.elsewhere.prepared.used]
    unit = float(np.sqrt(np.mean(columns[:, -1] ** 2)))
    problem.misfit.accepted[:] = 0.5 * deviation * unit
    for moved, same in ((-1.8, True), (1.8, True), (4.0, False)):
        theta = limit.posterior.theta + moved * deviation
        form = replace(limit, posterior=replace(limit.posterior, theta=theta))
        assert search.elsewhere.same(form, limit) is same
        beyond = max(abs(moved) - 1.96, 0.0) * deviation * unit
        assert search.elsewhere.lacking(form, limit) == pytest.approx(beyond, abs=0.1 * deviation * unit)


def test_a_form_adds_nothing_where_its_limit_is_in_it_and_what_it_has_more_is_not_told() -> None:
    """A straight spring is told in a form that may stiffen beyond where anything moved."""

    def beyond(q: FloatArray, shape: object) -> FloatArray:
        return np.asarray(np.maximum(np.abs(q) / REACH - 1.01, 0.0))

    def nearly(q: FloatArray, shape: object) -> FloatArray:
        return np.asarray(wave(9, q) + 1e-6 * wave(4, q))

    limit, straight = family("limit", spring(0.0)), spring(0.0)
    forms = {
        "not_told": family("not_told", straight, beside=beyond, essential=(1,)),
        "told": family("told", straight, beside=lambda q, shape: wave(13, q), essential=(1,)),
        "either": family("either", straight, beside=nearly, essential=(1,)),
        "none_essential": family("none_essential", straight, beside=beyond),
        "another": family("another", lambda q, shape: wave(13, q), beside=beyond, essential=(1,)),
    }
    search = searching(problem_of(lambda q: torque(q, w9=2.0, w13=2.0)), [limit, *forms.values()])
    empty = without_effects(search.problem)
    entries = library(search.problem.rows, search.wanted, present_with(search.problem, empty))
    fitted = {
        one.candidate.family.name: search.replaced(empty, [one])[0]
        for one in screen(search.problem, empty, entries)
    }
    adds = {name: search.elsewhere.adds(fitted[name], fitted["limit"]) for name in forms}
    assert adds == {name: name != "not_told" for name in forms}


def test_the_nearest_is_no_further_than_is_allowed() -> None:
    random = np.random.default_rng(3)
    columns = random.normal(size=(40, 3)) * (5.0, 1.0, 0.01)
    near = np.array([1.0, -1.0, 0.5])
    assert within(columns, columns @ near) == pytest.approx(near, abs=1e-6)
    wanted = columns @ np.array([2.0, 3.0, -1.0])
    found = within(columns, wanted)
    assert np.linalg.norm(found) == pytest.approx(1.96)
    for _ in range(50):
        other = random.normal(size=3)
        other *= 1.96 / np.linalg.norm(other)
        assert np.linalg.norm(wanted - columns @ found) <= np.linalg.norm(wanted - columns @ other)
    assert within(columns, np.zeros(40)) == pytest.approx(np.zeros(3))


@pytest.mark.parametrize("far", [1.0e12, 1.5e12, 2.7e12, 3.3e12])
def test_what_the_recordings_hardly_leave_open_is_followed_as_far_as_it_goes(far: float) -> None:
    """The price of a step is then that of its length alone, but for rounding."""
    assert within(np.array([[1e-8]]), np.array([far])) == pytest.approx([1.96], rel=1e-5)


@pytest.mark.parametrize("name", ["emps", "tx40"])
def test_every_joint_goes_over_its_travel_within_its_limits(name: str) -> None:
    robot, step = robots.load(name), 0.002
    swings = all_over(robot, step)
    assert swings.time[-1] == pytest.approx(24.0, abs=2.0 * step)
    position = swings.position
    assert (position <= robot.upper).all() and (position >= robot.lower).all()
    assert np.ptp(position, axis=0) / (robot.upper - robot.lower) == pytest.approx(
        np.full(robot.n, 0.9), rel=5e-3
    )
    speed = np.abs(np.diff(position, axis=0)).max(axis=0) / step
    acceleration = np.abs(np.diff(position, 2, axis=0)).max(axis=0) / step**2
    assert (speed <= robot.velocity_limits).all() and (acceleration <= robot.acceleration_limits).all()
    most = np.maximum(speed / robot.velocity_limits, acceleration / robot.acceleration_limits)
    assert (most > 0.7).all()
