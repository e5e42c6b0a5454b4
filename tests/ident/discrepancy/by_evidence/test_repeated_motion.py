"""Columns at a motion of which every period is the same, made of its first periods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.discrepancy.by_evidence.evidence.prepared import Part
from ident.discrepancy.by_evidence.evidence.repeated_motion import shorter
from ident.discrepancy.loop import depends_on_time
from ident.effects import State
from ident.effects.placed import Family, Placed
from ident.effects.vocabulary import VOCABULARY
from tests.ident.effects.test_vocabulary import TX40, middle, present

STEP, PERIOD, SAMPLES = 0.008, 625, 5 * 625 - 34
"""s; samples of a period of 5 s, and of nearly five of them."""
FORMS = [form for family in VOCABULARY for form in family.nested]
TIMELESS = [form for form in FORMS if form.timeless]


def periodic() -> State:
    """Every joint goes through whole waves in each period; recorded torques too."""
    time, waves = STEP * np.arange(SAMPLES), np.arange(1, TX40.n + 1)
    rate = 2.0 * np.pi * waves / (STEP * PERIOD)
    phase = np.outer(time, rate) + waves
    motion = (0.3 * np.cos(phase), -0.3 * rate * np.sin(phase), -0.3 * rate**2 * np.cos(phase))
    return State(*motion, time, 20.0 * np.sin(phase + 1.0), period=PERIOD)


def part(state: State, period: int | None) -> Part:
    used = np.ones(state.position.shape, dtype=np.bool_)
    return Part(state, state, np.zeros(state.position.shape), used, period, 1, STEP)


def placed(family: Family) -> Placed:
    place = family.places(TX40)[-1]
    return family.effect(TX40, place, middle(family, TX40, place), present("tx40"))


@pytest.mark.parametrize("family", FORMS, ids=lambda family: f"{family.name}: {family.sentence}")
def test_columns_are_those_of_the_whole_motion(family: Family) -> None:
    state, effect = periodic(), placed(family)
    whole = effect.columns(state)
    size = np.abs(whole).max()
    np.testing.assert_allclose(part(state, PERIOD).columns(effect), whole, rtol=0.0, atol=1e-6 * size)


@pytest.mark.parametrize("family", TIMELESS, ids=lambda family: f"{family.name}: {family.sentence}")
def test_what_calls_itself_timeless_has_no_course_in_time(family: Family) -> None:
    effect = placed(family)
    assert not depends_on_time(effect.simulated(np.ones(len(effect.parameters))))


def test_only_what_repeats_long_enough_is_made_shorter() -> None:
    state = periodic()
    short = shorter(state, PERIOD)
    assert short is not None and short.time is not None
    assert short.time.size == SAMPLES - PERIOD * ((SAMPLES - PERIOD - 2 * 375) // PERIOD)
    noisy = state.velocity.copy()
    noisy[SAMPLES // 2, 3] += 1e-4
    assert shorter(replace(state, velocity=noisy), PERIOD) is None
    assert (
        shorter(replace(state, torque=state.torque + np.linspace(0.0, 0.1, SAMPLES)[:, None]), PERIOD) is None
    )
    assert shorter(state, PERIOD - 1) is None
    beginning = slice(0, 2 * PERIOD)
    pieces = (getattr(state, name)[beginning] for name in ("position", "velocity", "acceleration", "time"))
    assert shorter(State(*pieces), PERIOD) is None
    calls = []
    effect = replace(placed(TIMELESS[0]), law=lambda asked: calls.append(asked.time.size) or asked.position)
    part(state, PERIOD).columns(effect)
    part(state, None).columns(effect)
    assert calls == [short.time.size, SAMPLES]
