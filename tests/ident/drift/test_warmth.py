"""A hall without a thermometer: what the other gears say of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.drift import DriftSettings, Geometry, Night, compare, patterns_of
from ident.drift.patterns import WARMTH, with_warmth
from ident.drift.prior import prior_of
from ident.drift.warmth import warmth_of_gears
from robots.arrays import FloatArray
from tests.ident.drift.arms_of_nights import covariance_within, draw_nights, geometry

SETTINGS = DriftSettings()


@pytest.fixture(scope="module")
def made() -> Geometry:
    return geometry()


def friction_change(made: Geometry, kelvin: float, coefficients: dict[str, float]) -> FloatArray:
    """(b,) that so many K colder make, with so much of each friction per kelvin."""
    found = np.zeros_like(made.beta)
    for pattern in patterns_of(made):
        if pattern.scale is not None and pattern.words in coefficients:
            found += kelvin * coefficients[pattern.words] * pattern.scale * pattern.directions[:, 0]
    return found


def usual_coefficients(made: Geometry) -> dict[str, float]:
    share = {
        "coulomb_friction": SETTINGS.coulomb_per_kelvin,
        "viscous_friction": SETTINGS.viscous_per_kelvin,
    }
    return {p.words: share[p.effect] for p in patterns_of(made) if p.effect in share}


def told_warmth(made: Geometry, changes: list[FloatArray]) -> dict[str, FloatArray]:
    patterns = with_warmth(patterns_of(made), SETTINGS)
    prior = prior_of(patterns, made, False, SETTINGS)
    values = np.array([made.beta, *(made.beta + change for change in changes)])
    found = warmth_of_gears(values, covariance_within(made) + prior.covariance, patterns, prior.unmeasured)
    return {p.words: found[1:, k] - found[0, k] for k, p in enumerate(patterns)}


def test_the_gears_tell_the_hall_in_kelvin(made: Geometry) -> None:
    usual = usual_coefficients(made)
    told = told_warmth(made, [friction_change(made, kelvin, usual) for kelvin in (8.0, -3.0)])
    for words in ("Coulomb friction of joint 2", "payload on the tool", "drive gain of joint 4"):
        np.testing.assert_allclose(told[words], [-8.0, 3.0], rtol=0.1)  # drawn a little towards none
        assert np.all(np.abs(told[words]) < [8.0, 3.0])
    assert not told["all gears as if colder"].any()


def test_a_fault_in_a_gear_is_no_weather_beside_it(made: Geometry) -> None:
    fault = friction_change(made, 1.0, {"viscous friction of joint 3": 0.5})
    told = told_warmth(made, [fault])
    assert abs(told["Coulomb friction of joint 3"][0]) < 0.02  # nor for its other friction
    assert abs(told["viscous friction of joint 3"][0]) < 0.02
    assert 0.5 < -told["viscous friction of joint 2"][0] < 10.0  # a little for those beside it


def test_without_friction_nothing_is_told(made: Geometry) -> None:
    patterns = [p for p in patterns_of(made) if p.effect == "current_offset"]
    assert WARMTH not in {p.effect for p in patterns}
    assert not warmth_of_gears(made.beta[np.newaxis], np.eye(made.beta.size), patterns, 5.0).any()


def test_a_single_gear_is_no_measure_of_itself() -> None:
    made = geometry("emps")
    usual = usual_coefficients(made)
    told = told_warmth(made, [friction_change(made, 20.0, usual), 0.25 * made.beta])
    assert all(abs(found).max() < 0.05 for words, found in told.items() if "joint 1" in words)


def winter(made: Geometry, nights: int, seed: int, most: float = 14.0) -> list[Night]:
    """A hall that cools down by so many K; each gear has a coefficient of its own, 0.5 to 1.5 times."""
    rng = np.random.default_rng(seed)
    own = {words: share * rng.uniform(0.5, 1.5) for words, share in usual_coefficients(made).items()}
    drawn = draw_nights(made, nights, seed, per_kelvin=0.0)
    return [
        replace(
            night,
            values=night.values + friction_change(made, most * k / (nights - 1), own),
            celsius=None,
        )
        for k, night in enumerate(drawn)
    ]


def test_a_winter_that_nobody_measured_is_no_fault_of_single_gears(made: Geometry) -> None:
    """Every gear follows the hall in its own way, which its own nights tell."""
    nights = winter(made, 90, 3)
    for night in (31, 50, 70, 89):
        found = compare(nights[0], nights[1 : night + 1], made)
        assert found.state == "unchanged", found.sentence


def test_a_step_in_such_a_winter_is_told(made: Geometry) -> None:
    nights = winter(made, 90, 3)
    joint = next(p for p in patterns_of(made) if p.words == "Coulomb friction of joint 2")
    assert joint.scale is not None
    step = 0.2 * joint.scale * joint.directions[:, 0]
    nights[80:] = [replace(night, values=night.values + step) for night in nights[80:]]
    found = compare(nights[0], nights[1:82], made)
    assert found.changes[0].words == "Coulomb friction of joint 2", found.sentence
    assert found.changes[0].relative == pytest.approx(0.2, abs=0.07)
    assert found.since is not None and (found.since.index, found.since.shape) == (80, "step")
