"""What the search over sets does, on an axis whose effects are waves over its position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from ident.discrepancy.by_evidence.decide import names
from ident.discrepancy.by_evidence.decide import search as module
from ident.discrepancy.by_evidence.decide.names import slot
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME, OUTSIDE
from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.screening import Screened, screen, with_all_forms
from ident.discrepancy.by_evidence.decide.search import Search
from ident.discrepancy.by_evidence.decide.shapes import refined
from ident.discrepancy.by_evidence.decide.state import Member, found_set, without_effects
from ident.discrepancy.by_evidence.decide.told import simplified
from ident.discrepancy.by_evidence.library.candidates import Entry, candidates, library
from ident.effects.family import Shape
from ident.effects.placed import Family
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.toy_effects import (
    NotLookedAt,
    family,
    names_of,
    problem_of,
    searching,
    torque,
    wave,
    waves,
)


def test_two_effects_that_hide_behind_each_other_are_found_together() -> None:
    """Alone neither has anything of what both leave of each other."""
    hidden = [waves("both", w9=200.0, w11=1.0), waves("one", w9=200.0)]
    found = searching(problem_of(lambda q: torque(q, w11=1.0)), hidden).run()
    assert names_of(found) == ["both", "one"]


def test_what_is_one_of_a_few_is_tried_with_the_shapes_that_fit() -> None:
    """On the grid, whose number is not the right one, the other kind comes nearer."""

    def course(position: FloatArray, shape: Sequence[float]) -> FloatArray:
        number, kind = shape
        return wave(number, position) + kind * torque(position, w9=0.5, w20=0.5)

    shapes = (Shape("number", "1", (8.2,), 7.0, 11.0), Shape("kind", "1", (0.0, 1.0), 0.0, 1.0, fixed=True))
    search = searching(problem_of(lambda q: torque(q, w9=1.0)), [family("either", course, shapes)])
    empty = without_effects(search.problem)
    entries = library(search.problem.rows, search.wanted, present_with(search.problem, empty))
    (screened,) = screen(search.problem, empty, entries)
    assert screened.best.entry.placed.shape == (8.2, 1.0)
    (member,) = search.run().found.members
    assert member.entry.placed.shape == (pytest.approx(9.0, abs=0.02), 0.0)


@pytest.mark.parametrize(("leaders", "paired"), [(2, 6), (10, 2)])
def test_forms_of_one_name_take_no_place_of_another_name(
    monkeypatch: pytest.MonkeyPatch, leaders: int, paired: int
) -> None:
    """Three forms of the louder name come before the other; both are there, and are found with one step."""
    monkeypatch.setattr(module, "LEADERS", leaders)
    monkeypatch.setattr(module, "_PAIRED", paired)
    others = tuple(waves("loud", w9=1.0, w13=share) for share in (0.02, 0.04))
    families = [replace(waves("loud", w9=1.0), forms=others), waves("quiet", w17=1.0)]
    search = searching(problem_of(lambda q: torque(q, w9=2.0, w17=0.5)), families)
    empty = without_effects(search.problem)
    present = present_with(search.problem, empty)
    entries = library(search.problem.rows, search.wanted, present)
    order = [one.candidate.family.name for one in screen(search.problem, empty, entries)]
    assert order == ["loud", "loud", "loud", "quiet"]
    better = search._extended(empty, entries, present)
    assert better is not None
    assert {member.candidate.family.name for member in better.members} == {"loud", "quiet"}


def test_what_came_first_and_is_superfluous_is_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mixture is likeliest until all that it is a mixture of is there."""
    monkeypatch.setattr(module, "_PAIRED", 1)
    parts = [waves("mixture", w9=1.0, w11=1.0, w13=0.4), waves("nine", w9=1.0), waves("eleven", w11=1.0)]
    found = searching(problem_of(lambda q: torque(q, w9=1.0, w11=1.0)), parts).run()
    assert names_of(found) == ["eleven", "nine"]


def test_what_came_first_is_changed_for_what_is_a_little_likelier(monkeypatch: pytest.MonkeyPatch) -> None:
    """One more effect costs more than the difference; in the place of the other it costs nothing."""
    monkeypatch.setattr(module, "_PAIRED", 1)
    parts = [waves("first", w9=1.0, w11=0.5, w13=0.011), waves("nine", w9=1.0), waves("eleven", w11=1.0)]
    found = searching(problem_of(lambda q: torque(q, w9=1.0, w11=0.6)), parts).run()
    assert names_of(found) == ["eleven", "nine"]


def of_torque(force: np.ndarray) -> np.ndarray:
    """Torque of an effect that follows the model's torque in waves of 4 N."""
    return np.asarray(np.sin(0.5 * np.pi * force))


def test_columns_of_a_member_are_made_of_the_model_with_the_rest_of_the_set() -> None:
    """With the other member in the model, and without its own torque: else its size and form are others."""

    def hidden(position: np.ndarray) -> np.ndarray:
        speed = np.gradient(
            position
        )  # the viscous friction of the axis, whose sign the position does not have
        rest = 10.0 * speed / np.abs(speed).max() + torque(position, w9=3.0)
        return torque(position, w9=3.0) + 1.5 * of_torque(rest)

    follows = family("follows", lambda q, shape: q, of_model=of_torque)
    found = searching(problem_of(hidden), [waves("nine", w9=1.0), follows]).run()
    assert names_of(found) == ["follows", "nine"]
    sizes = {m.candidate.family.name: found.found.theta(k)[0][0] for k, m in enumerate(found.found.members)}
    assert sizes["follows"] == pytest.approx(1.5, rel=0.05)
    assert sizes["nine"] == pytest.approx(3.0, rel=0.05)


WIDTH = (8.0, 12.0)


def number(grid: tuple[float, ...]) -> Shape:
    return Shape("number", "1", grid, *WIDTH)


def of_any_number(grid: tuple[float, ...]) -> Family:
    return family("any", lambda q, shape: wave(shape[0], q), (number(grid),))


def screened(one: Family, number_of_waves: float = 9.0) -> Screened:
    problem = problem_of(lambda q: torque(q, **{f"w{number_of_waves}": 1.0}))
    empty = without_effects(problem)
    wanted = candidates(problem.prepared.robot, [one])
    return screen(problem, empty, library(problem.rows, wanted, present_with(problem, empty)))[0]


def test_shapes_are_averaged_over_their_grid() -> None:
    """One of four is right: a quarter of its likelihood."""
    alone, four = screened(waves("nine", w9=1.0)), screened(of_any_number((8.0, 9.0, 10.0, 11.0)))
    assert alone.gain - four.gain == pytest.approx(np.log(4.0), abs=1e-6)


def test_a_screened_candidate_is_as_likely_as_its_set() -> None:
    problem = problem_of(lambda q: torque(q, w9=0.3))
    empty = without_effects(problem)
    wanted = candidates(problem.prepared.robot, [waves("nine", w9=1.0)])
    (one,) = screen(problem, empty, library(problem.rows, wanted, present_with(problem, empty)))
    accepted = problem.level.changed(0, kappa=float(problem.misfit.accepted[0]), excess=1.0)
    own, usual = (
        found_set(problem, (one.best,), level, ()).log_posterior - empty.log_posterior
        for level in (problem.level, accepted)
    )
    assert own < usual - 1.0
    assert one.log_odds == pytest.approx(usual, abs=1e-6)


@pytest.mark.parametrize(
    ("hidden", "at", "there"),
    [("w9", 9.0, (8.7, 9.3)), ("w12.2", 12.0, (11.5, 12.0))],
    ids=["within", "beyond"],
)
def test_the_best_shape_costs_what_integrating_over_all_costs(
    hidden: str, at: float, there: tuple[float, float]
) -> None:
    """Laplace's method against an integral over the width of the prior; also where the limit is likeliest."""
    problem = problem_of(lambda q: torque(q, **{hidden: 0.5}))
    empty = without_effects(problem)
    present = present_with(problem, empty)
    (one,) = candidates(problem.prepared.robot, [of_any_number((at + 0.1 if at < 12.0 else 11.9,))])

    def set_of(value: float) -> tuple[Member, float]:
        placed = one.at(problem.prepared.robot, (value,), present)
        member = Member(Entry(one, placed, problem.rows.effect(placed)), 0.0)
        return member, found_set(problem, (member,), problem.level, ()).log_evidence

    start, _ = set_of(one.shapes[0].grid[0])
    first = found_set(problem, (start,), problem.level, ())
    best = refined(problem, (start,), 0, first, present)
    value = best.entry.placed.shape[0]
    assert value == pytest.approx(at, abs=0.05)
    reference = set_of(value)[1]
    whole, _ = quad(lambda x: float(np.exp(set_of(x)[1] - reference)), *there, limit=30, epsrel=1e-2)
    assert best.volume == pytest.approx(np.log(whole / (WIDTH[1] - WIDTH[0])), abs=0.25)


def test_every_candidate_is_asked_in_a_names_place_each_with_its_own_misfit() -> None:
    """What explains nine tenths of it is fitted as it would be alone, not with the misfit of its absence."""
    problem = problem_of(lambda q: torque(q, w9=1.0))
    families = [waves("payload", w9=1.0), waves("contact", w9=1.0, w13=0.1), waves("backlash", w17=1.0)]
    search = searching(problem, families)
    searched = search.run()
    assert names_of(searched) == ["payload"]
    empty = search.without(searched.found, 0)
    said = slot(search, searched, 0, empty, NotLookedAt())
    assert {one.name for one in said.names} == {"nothing", "payload", "contact", "backlash", NO_NAME}
    (entry,) = (one for one in searched.entries if one.candidate.family.name == "contact")
    alone = found_set(problem, (Member(entry, 0.0),), empty.level, (0,))
    fitted = alone.log_posterior - empty.log_posterior
    assert said.log_odds(("contact", (0,))) == pytest.approx(fitted, abs=0.1)
    one, other = said.log_odds(("payload", (0,))), said.log_odds(("backlash", (0,)))
    assert one > fitted + 2.0 and other < 0.0
    share = 1.0 / (1.0 + np.exp(fitted - one) + OUTSIDE)
    assert said.probability(("payload", (0,))) == pytest.approx(share, abs=0.01)


def test_a_rival_has_columns_of_the_model_that_is_fitted_beside_it() -> None:
    """The same effect by another name is as likely; the model without it has taken up a part of it."""

    def of_both(force: np.ndarray) -> np.ndarray:
        return np.asarray(of_torque(force) + 0.03 * force)

    def hidden(position: np.ndarray) -> np.ndarray:
        speed = np.gradient(position)
        return 3.0 * of_both(10.0 * speed / np.abs(speed).max())

    def follows(name: str) -> Family:
        return family(name, lambda q, shape: q, of_model=of_both)

    search = searching(problem_of(hidden), [follows("payload"), follows("contact")])
    searched = search.run()
    assert len(searched.found.members) == 1
    said = slot(search, searched, 0, search.without(searched.found, 0), NotLookedAt())
    one, other = (said.log_odds((name, (0,))) for name in ("payload", "contact"))
    assert one == pytest.approx(other, abs=3.0)


def with_a_late_form() -> Family:
    """A name of two forms: one that is a little wrong, and one that is right, but not on its grid."""
    late = replace(of_any_number((8.3,)), name="contact")
    return replace(waves("contact", w9=1.0, w13=0.1), forms=(late,))


def spikes(q: FloatArray) -> FloatArray:
    """What a drive at its limit lacks: nothing, but at the ends of the range, where it is much."""
    return np.asarray(np.maximum(np.abs(q) - 0.97 * np.abs(q).max(), 0.0) / (0.03 * np.abs(q).max()))


def test_what_makes_rows_rough_is_screened_as_it_would_leave_them() -> None:
    """At the level of a set without it all that rows show of it is noise of theirs."""
    search = searching(
        problem_of(lambda q: 40.0 * spikes(q) + torque(q, w9=0.1)),
        [family("spikes", lambda q, shape: spikes(q)), waves("nine", w9=1.0)],
    )
    problem = search.problem
    empty = without_effects(problem)
    assert empty.level.excess[0] > 2.0
    present = present_with(problem, empty)
    one = screen(problem, empty, library(problem.rows, search.wanted, present))[0]
    assert one.candidate.family.name == "spikes"
    fitted = found_set(problem, (one.best,), empty.level, (0,))
    assert one.gain == pytest.approx(fitted.log_evidence - empty.log_evidence, rel=0.1)


def order_of(search: Search) -> list[str]:
    """Names in the order in which they are screened beside nothing."""
    empty = without_effects(search.problem)
    entries = library(search.problem.rows, search.wanted, present_with(search.problem, empty))
    return [one.candidate.family.name for one in screen(search.problem, empty, entries)]


def test_a_rival_is_asked_in_all_forms_of_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its second form comes after another name, and is as good as what is shown once it is fitted."""
    monkeypatch.setattr(names, "_FITTED", 1)
    families = [waves("payload", w9=1.0), with_a_late_form(), waves("backlash", w9=1.0, w13=0.3)]
    search = searching(problem_of(lambda q: torque(q, w9=1.0)), families)
    assert order_of(search) == ["payload", "contact", "backlash", "contact"]
    searched = search.run()
    assert names_of(searched) == ["payload"]
    said = slot(search, searched, 0, search.without(searched.found, 0), NotLookedAt())
    own, rival, other = (said.log_odds((name, (0,))) for name in ("payload", "contact", "backlash"))
    assert own - 6.0 < rival < own
    assert other < own - 20.0


def test_what_came_first_is_changed_for_any_form_of_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    for figure in ("LEADERS", "_PAIRED", "_SWAPPED", "MOST"):
        monkeypatch.setattr(module, figure, 1)
    families = [waves("first", w9=1.0, w13=0.08), with_a_late_form(), waves("backlash", w9=1.0, w13=0.3)]
    search = searching(problem_of(lambda q: torque(q, w9=1.0)), families)
    assert order_of(search) == ["first", "contact", "backlash", "contact"]
    assert names_of(search.run()) == ["contact"]


@pytest.mark.parametrize(("more", "kept"), [(0.1, "stribeck_friction"), (0.0, "coulomb_friction")])
def test_a_form_stays_where_it_is_sure_and_is_its_limit_where_it_is_not(
    monkeypatch: pytest.MonkeyPatch, more: float, kept: str
) -> None:
    """However much the reported set holds: a form with nine tenths of the probability is no limit."""
    monkeypatch.setattr(names, "HELD", 2.0)
    limit = waves("coulomb_friction", w9=1.0)
    part = Shape("part", "1", (0.0, 0.1, 0.2), 0.0, 1.0)
    form = family(
        "stribeck_friction",
        lambda q, shape: wave(9.0, q) + shape[0] * wave(13.0, q),
        (part,),
        ("coulomb_friction",),
    )
    problem = problem_of(lambda q: torque(q, w9=1.0, w13=more))
    search = searching(problem, [form])
    searched = search.run()
    assert names_of(searched) == ["stribeck_friction"]
    wanted = candidates(problem.prepared.robot, [form, limit])
    both = replace(searched, entries=library(problem.rows, wanted, searched.present))
    assert names_of(simplified(search, both, NotLookedAt())) == [kept]


@pytest.mark.parametrize("repeats", [True, False])
def test_rates_are_made_of_a_lower_cut_off_where_nothing_repeats(repeats: bool) -> None:
    """Noise at half the rows' cut-off is gone then; what repeats has none of it, and keeps all it has."""
    problem = problem_of(lambda q: torque(q, w9=1.0))
    state = problem.prepared.parts[0].other
    random = np.random.default_rng(0)
    state.acceleration[:] = random.normal(size=state.acceleration.shape)
    seen = PresentWith(problem.present, (), repeats).low_cutoff(state).acceleration
    assert bool(np.std(seen) < 0.7 * np.std(state.acceleration)) is not repeats


def test_links_that_are_found_are_in_the_model() -> None:
    """Friction of a load is that of the payload, too: so it is no torque beside the links."""
    heavier = family("payload", lambda q, shape: wave(9.0, q), links=np.ones((1, 10)))
    problem = problem_of(lambda q: torque(q, w9=1.0))
    searched = searching(problem, [heavier]).run()
    assert names_of(searched) == ["payload"]
    state = problem.prepared.parts[0].at_rows
    model, plain = (present_with(problem, searched.found, but=but) for but in (None, 0))
    more = model.link_torque(state) - plain.link_torque(state)
    assert not model.beside
    assert more[:, 0] == pytest.approx(searched.found.theta(0)[0][0] * state.acceleration[:, 0], abs=1e-6)


def test_a_swap_that_was_tried_is_not_fitted_again_for_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    search = searching(
        problem_of(lambda q: torque(q, w9=1.0)), [of_any_number((8.9,)), waves("nine", w9=1.0)]
    )
    found = search.run()
    without = search.without(found.found, 0)
    others = screen(search.problem, without, found.entries)
    sets = search.replaced(without, others)
    monkeypatch.setattr(module, "refined", None)
    assert search.without(found.found, 0) is without
    assert [id(one) for one in search.replaced(without, others[::-1])] == [id(one) for one in sets[::-1]]
    with pytest.raises(TypeError):  # beside another set all is fitted
        search.replaced(found.empty, others)


@pytest.mark.parametrize(("damping", "count"), [(None, 3), (np.eye(1), 2)])
def test_no_joint_has_three_frictions(damping: FloatArray | None, count: int) -> None:
    """Three frictions together describe any law there is; what two leave stays unexplained."""
    problem = problem_of(lambda q: torque(q, w9=1.0, w13=1.0, w17=1.0))
    families = [
        family(name, lambda q, shape, number=number: wave(number, q), damping=damping)  # type: ignore[misc]
        for name, number in (("payload", 9.0), ("contact", 13.0), ("backlash", 17.0))
    ]
    searched = searching(problem, families).run()
    assert len(names_of(searched)) == count
    left = searched.found.level.kappa[0] > 3.0 * problem.misfit.accepted[0]
    assert left == (count == 2) or searched.found.level.excess[0] > 2.0


def test_what_passes_for_a_name_is_asked_wherever_it_stands_in_the_order() -> None:
    """Friction of the load on the motor's side was 5th on its grid, beside a directional efficiency."""

    def one(name: str, joint: int, log_odds: float) -> Any:
        return SimpleNamespace(candidate=SimpleNamespace(key=(name, (joint,))), log_odds=log_odds)

    own: Any = SimpleNamespace(key=("directional_efficiency", (3,)))
    order = [
        one("cable_spring", 3, 9.0),
        one("load_dependent_friction", 2, 8.0),
        one("load_dependent_friction", 3, 7.0),
        one("cable_spring", 3, 6.0),
        one("load_dependent_friction", 3, 5.0),
        one("drive_gain_error", 3, -1.0),
    ]
    assert with_all_forms(order, 1, own) == [order[0], order[2], order[3], order[4]]
