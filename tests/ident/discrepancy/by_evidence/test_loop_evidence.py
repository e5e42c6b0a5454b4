"""The evidence of the simulated loop: what shows at reversals has a name, and a clean arm has none."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import robots
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, identify
from ident.discrepancy import Prior, Question, accepted_noise, accepted_prior
from ident.discrepancy.by_evidence import diagnosis
from ident.discrepancy.by_evidence.reversals import likeliest_in_loop, posed_in_loop
from ident.discrepancy.step import LoopStep
from ident.discrepancy.workflow import Search, silent
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import hidden, recorded

FAMILIES = [
    family_named(name) for name in ("static_friction", "hysteresis", "joint_elasticity", "stribeck_friction")
]


def in_loop(scenario: Scenario) -> LoopStep:
    """A one-axis arm with something hidden, against its model from before, examined in closed loop."""
    robot = robots.load("emps")
    accepted, fit = (
        recorded(robot, 700, given, 0, seed, 8.0) for seed, given in ((1, Scenario()), (2, scenario))
    )
    estimate = identify(robot, (accepted,)).result.recommended

    def prior(base: BaseParameters) -> Prior:
        noise = accepted_noise(base, (accepted,))
        return accepted_prior(base, estimate.values, estimate.covariance, noise=noise)

    step = Search(Question(robot, (fit,), (fit,), (), prior), silent).step.in_loop()
    return cast(LoopStep, step)


@pytest.fixture(scope="module")
def falling() -> LoopStep:
    return in_loop(hidden({"stribeck_friction": [{"drive": 1, "rise": 3.0, "speed": 0.01}]}))


def test_friction_that_falls_with_speed_is_named_at_its_drive(falling: LoopStep) -> None:
    found = likeliest_in_loop(falling, FAMILIES, set(), {0})
    assert found is not None
    assert found.key == ("stribeck_friction", (0,))
    assert found.names.probability(found.key) > 0.9
    assert found.names.log_odds(found.key) == pytest.approx(
        max(one.log_odds for one in found.names.names), abs=1e-9
    )


def test_what_was_found_is_no_further_effect(falling: LoopStep) -> None:
    found = likeliest_in_loop(falling, FAMILIES, {("stribeck_friction", (0,))}, {0})
    assert found is None or found.key != ("stribeck_friction", (0,))


def test_a_clean_arm_has_no_name_and_its_loop_leaves_noise() -> None:
    clean = in_loop(Scenario())
    assert likeliest_in_loop(clean, FAMILIES, set(), {0}) is None
    problem, rows = posed_in_loop(clean)
    assert problem.level.excess.max() < 1.2
    assert problem.level.kappa.max() < 0.5 * max(one.marginal for one in rows.noise)
    at_rest = ~rows.prepared.used
    assert np.isfinite(rows.known.columns).all() and at_rest.any()


@pytest.mark.parametrize("sure", [True, False])
def test_what_scores_choose_has_the_name_of_the_evidence_or_none(
    monkeypatch: pytest.MonkeyPatch, falling: LoopStep, sure: bool
) -> None:
    named = likeliest_in_loop(falling, FAMILIES, set(), {0})
    assert named is not None
    monkeypatch.setattr(diagnosis, "likeliest_in_loop", lambda *_: named if sure else None)
    taken: list[tuple[str, float | None]] = []
    course = SimpleNamespace(
        add_in_loop=lambda component, basis: taken.append((component.family.name, basis.probability))
    )
    led: Any = SimpleNamespace(
        step=falling,
        question=SimpleNamespace(families=FAMILIES),
        findings=[],
        confusable=set(),
        settled=set(),
        course=course,
    )
    chosen: Any = SimpleNamespace(
        trials=[SimpleNamespace(place=Place("drive", (0,)), key=("hysteresis", (0,)))]
    )
    diagnosis._Led._take(led, chosen, cast(Any, None))
    assert [name for name, _ in taken] == (["stribeck_friction"] if sure else [])
    assert led.settled == (set() if sure else {0})


def test_another_joint_has_no_part_in_it(falling: LoopStep) -> None:
    assert likeliest_in_loop(falling, FAMILIES, set(), {1}) is None
