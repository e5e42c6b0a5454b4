"""Effects that are found together are fitted beside each other."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident import RegressorModel
from ident.effects import State
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from ident.parameters.present import Present
from tests.ident.discrepancy.blind_search import search

ROBOT = robots.load("tx40")
LOADS = [family_named(name) for name in ("payload", "load_dependent_friction", "coulomb_friction")]


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


@pytest.mark.slow
def test_friction_of_a_load_is_that_of_the_payload_too() -> None:
    """Without the payload in its column the friction came out half again as large, and left a third name."""
    hidden = {
        "payload": {"mass": 2.0, "centre": [0.0, 0.0, 0.09]},
        "load_dependent_friction": [{"drive": 2, "coefficient": 0.25}],
    }
    found = search("tx40", 77, hidden, duration=8.0, vocabulary=LOADS, at_reversals=False)
    assert {one.effect for one in found.findings} == {"payload", "load_dependent_friction"}
    assert found.verdict == "named"
    friction = next(one for one in found.findings if one.effect == "load_dependent_friction")
    mu = next(p for p in friction.parameters if p.name == "mu2")
    assert mu.value == pytest.approx(0.25, rel=0.05)
    # What each closes, not both together.
    assert len({tuple(one.gap.before) for one in found.findings}) == 2
    for one in found.findings:
        assert one.confirmation.torque.share == pytest.approx(1.0, abs=0.1)
        assert np.allclose(one.gap.after, found.torque.after)
