"""Effects that are found together are fitted beside each other."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from drivers.simulated import draw_truth
from drivers.simulated.scenario import Scenario
from ident import RegressorModel
from ident.discrepancy import Question
from ident.discrepancy.basis import Basis
from ident.discrepancy.by_evidence import prior_by_evidence
from ident.discrepancy.by_evidence.diagnosis import course_of, validation_of
from ident.discrepancy.component import Component
from ident.discrepancy.prepared_recording import prepared_recordings
from ident.effects import State
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from ident.parameters.present import Present
from tests.ident.discrepancy.blind_search import hidden, recorded

ROBOT = robots.load("tx40")


def with_effect(name: str, place: Place, values: list[float], shape: tuple[float, ...] = ()) -> Present:
    usual = RegressorModel.of(ROBOT)
    plain = Present(usual, usual.prior())
    effect = family_named(name).effect(ROBOT, place, shape, plain)
    model = RegressorModel(ROBOT, (*usual.effects, effect))
    return Present(model, np.concatenate([plain.standard, values]))


def moved() -> State:
    generator = np.random.default_rng(0)
    position, velocity, acceleration = generator.uniform(-1.0, 1.0, (3, 50, 6))
    return State(position, velocity, acceleration)


def test_what_is_found_at_the_tool_is_a_part_of_the_links() -> None:
    state, values = moved(), [2.0, 0.01, -0.02, 0.2, 0.03, 0.0, 0.03, 0.001, 0.0, 0.002]
    place = Place("tool", ())
    loaded = with_effect("payload", place, values)
    plain = loaded.without("payload", place)
    effect = loaded.model.effects[-1]
    added = effect.columns(state) @ np.array(values)
    np.testing.assert_allclose(loaded.link_torque(state), plain.link_torque(state) + added, atol=1e-9)
    np.testing.assert_allclose(loaded.torque(state), plain.torque(state) + added, atol=1e-9)
    heavier = loaded.link_mass_matrix(state.position) - plain.link_mass_matrix(state.position)
    assert (np.linalg.eigvalsh(heavier)[:, -1] > 0.01).all()


def test_a_tilt_is_a_part_of_gravity_and_goes_through_the_gears() -> None:
    state, values, place = moved(), [0.02, -0.03], Place("base", ())
    tilted = with_effect("base_tilt", place, values)
    plain = tilted.without("base_tilt", place)
    added = tilted.model.effects[-1].columns(state) @ np.array(values)
    np.testing.assert_allclose(tilted.link_torque(state), plain.link_torque(state) + added, atol=1e-9)
    np.testing.assert_allclose(tilted.torque(state), plain.torque(state) + added, atol=1e-9)


def test_an_effect_is_not_made_of_its_own_torque() -> None:
    place = Place("drive", (1,))
    present = with_effect("drive_gain_error", place, [0.3])
    state = moved()
    others = present.without("drive_gain_error", place)
    assert others.without("payload", Place("tool", ())) is others
    assert present.without("drive_gain_error", place) is others
    assert np.abs(present.torque(state) - others.torque(state))[:, 1].max() > 1.0


def test_friction_of_a_load_is_that_of_the_payload_too() -> None:
    """Without the payload in its column the friction came out 2 % too large, by four of its deviations."""
    scenario = hidden(
        {
            "payload": {"mass": 2.0, "centre": [0.0, 0.0, 0.09]},
            "load_dependent_friction": [{"drive": 2, "coefficient": 0.25}],
        }
    )
    accepted = recorded(ROBOT, 77, Scenario(), 0, 1, 8.0)
    fit, held = (recorded(ROBOT, 77, scenario, motion, 2 + motion, 8.0) for motion in (0, 1))
    course = course_of(
        Question(ROBOT, (fit,), (held,), (), lambda base: prior_by_evidence(base, (accepted,)))
    )
    components = [
        Component(family_named("payload"), Place("tool", ()), ()),
        Component(family_named("load_dependent_friction"), Place("drive", (1,)), (1.0,)),
    ]
    course.take(components, [Basis(0.0, 100.0, 2.2, 1.0, (), ())] * 2)
    validation = validation_of(course, prepared_recordings(course.first.base.model.robot, (held,)), None)
    payload, friction = course.validated(validation)[0]
    mu = next(p for p in friction.parameters if p.name == "mu2")
    assert mu.value == pytest.approx(0.25, rel=0.01)
    # What each closes, not both together.
    assert not np.allclose(payload.gap.before, friction.gap.before)
    for one in (payload, friction):
        assert one.confirmation.torque.share == pytest.approx(1.0, abs=0.1)
        assert np.allclose(one.gap.after, validation.gap(course.first, course.step).after)


def test_a_drag_that_comes_at_other_times_in_each_period_is_found_whole() -> None:
    """It is noise to a model without it, and in rows that are white by that it had half of its size."""
    drag, shape = draw_truth(ROBOT, 77).parameters["Fc2"], (3.7, 0.35, 0.0)
    scenario = hidden({"dragging_brake": [{"drive": 2, "rise": 1.0, "period": 3.7, "share": 0.35}]})
    fit, held = (recorded(ROBOT, 77, scenario, motion, 2 + motion, 8.0) for motion in (0, 1))
    question = Question(ROBOT, (fit,), (held,), ())
    component = Component(family_named("dragging_brake"), Place("drive", (1,)), shape)
    basis = [Basis(0.0, 100.0, 2.2, 1.0, (), ())]
    courses = [course_of(question) for _ in range(2)]
    courses[0].take([component], basis)
    courses[1].take([component], basis, [np.array([drag])])
    without, beside = (one.first.examination.whitening.sigma for one in courses)
    assert beside[1] < 0.6 * without[1]
    assert np.delete(beside, 1) == pytest.approx(np.delete(without, 1), rel=0.01)
    found = courses[1].findings[0]
    assert found.linear == pytest.approx([drag], abs=3.0 * found.linear_sigma[0])
    assert found.linear_sigma[0] < 0.01 * drag
    assert courses[0].findings[0].linear[0] < 0.7 * drag
