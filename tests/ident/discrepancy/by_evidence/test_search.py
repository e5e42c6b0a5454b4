"""The whole search by evidence on one simulated axis: nothing, an effect with its size, the same twice."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

import robots
from drivers.simulated.scenario import Scenario
from ident import Recording
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import (
    EvidenceAnswer,
    diagnose_by_evidence,
    prior_by_evidence,
    workflow,
)
from ident.discrepancy.by_evidence.decide.present_with import PresentWith
from ident.discrepancy.by_evidence.decide.search import Search
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.report.as_json import answer_json
from ident.discrepancy.prior import Prior
from ident.effects.placed import Family
from ident.effects.vocabulary import family_named
from ident.parameters.base import BaseParameters
from robots.description import Robot
from tests.ident.discrepancy import blind_search

EMPS, TRUTH, DURATION = robots.load("emps"), 501, 5.0
FEW = tuple(
    family_named(name)
    for name in ("viscous_friction", "coulomb_friction", "drive_gain_error", "time_delay", "torque_ripple")
)


def recorded(scenario: dict[str, object], motion: int, seed: int, robot: Robot = EMPS) -> Recording:
    hidden = blind_search.hidden(scenario) if scenario else Scenario()
    return blind_search.recorded(robot, TRUTH, hidden, motion, seed, DURATION)


@cache
def accepted() -> Recording:
    return recorded({}, 0, 1)


def prior(base: BaseParameters) -> Prior:
    return prior_by_evidence(base, (accepted(),))


def search(
    scenario: dict[str, object],
    validated: dict[str, object] | None = None,
    families: Sequence[Family] = FEW,
    robot: Robot = EMPS,
) -> EvidenceAnswer:
    fit = recorded(scenario, 0, 2, robot)
    validation = recorded(scenario if validated is None else validated, 1, 3, robot)
    question = Question(robot, (fit,), (validation,), tuple(families), prior)
    return diagnose_by_evidence(question)


def test_a_clean_arm_gets_no_name() -> None:
    answer = search({})
    assert not answer.findings
    assert answer.probability_clean > 0.9
    assert answer.joints[0].above < 0.1
    assert answer.joints[0].after < 0.01


def test_an_arm_that_gate_1_rejects_is_not_clean(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workflow, "_gate_one_rejects", lambda *given: True)
    answer = search({})
    assert (answer.verdict, answer.gate_one_rejected, answer.findings) == ("unnamed", True, ())


def test_the_size_that_would_still_be_named_is_said_and_holds() -> None:
    clean = search({})
    said = {one.name: one for one in clean.nameable if one.joints == (1,)}
    viscous = said["viscous_friction"]
    assert (viscous.parameter, viscous.unit) == ("Fv1", "N·s/m")
    described = robots.load("emps").drive[0].dynamics.viscous
    for share, named in ((1.4, True), (0.7, False)):
        change = share * viscous.size / described
        answer = search({"viscous_friction": [{"drive": 1, "change": change}]})
        assert any(finding.sure for finding in answer.findings) is named, change
    near = clean.joints[0].nearest
    assert near is not None and near.probability < 0.5


def test_a_change_of_friction_is_named_with_its_size_and_confirmed() -> None:
    answer = search({"viscous_friction": [{"drive": 1, "change": 0.3}]})
    assert answer.verdict == "named"
    first = answer.findings[0]
    assert (first.name, first.joints) == ("viscous_friction", (1,))
    assert first.probability > 0.9
    assert first.held_up
    value = first.parameters[0]
    described = robots.load("emps").drive[0].dynamics.viscous
    assert value.value == pytest.approx(0.3 * described, rel=0.15)
    assert value.sigma < 0.1 * value.value
    assert answer.joints[0].after < 0.5 * answer.joints[0].before


def test_what_the_other_recording_does_not_bear_out_is_not_confirmed() -> None:
    answer = search({"viscous_friction": [{"drive": 1, "change": 0.3}]}, validated={})
    assert answer.verdict == "unnamed"
    assert "not confirmed" in answer.findings[0].words() and answer.findings[0].probability < 0.1


def test_a_cable_that_stiffens_is_no_straight_spring_with_a_contact() -> None:
    """On an axis of 0.3 m it pulls with a quarter of the rated torque at the end of the travel."""
    springs = tuple(family_named(name) for name in ("gravity_spring", "cable_spring", "contact"))
    cable = {"joint": 1, "stiffness": 8.0, "cubic": 3000.0, "centre": -0.03}
    answer = search({"cable_spring": [cable]}, families=(*FEW, *springs))
    assert answer.verdict == "named"
    assert [one.name for one in answer.findings] == ["cable_spring"]
    value = {one.name: one.value for one in answer.findings[0].parameters}
    assert value["stiffening1"] == pytest.approx(3000.0, rel=0.1)
    assert value["rest_angle"] == pytest.approx(-0.03, abs=0.003)


def test_every_leader_is_looked_at_with_its_best_shape(monkeypatch: pytest.MonkeyPatch) -> None:
    shaped: list[str] = []
    original = Search._shaped

    def noted(self: Search, found: Found, present: PresentWith) -> Found:
        shaped.append(found.members[-1].candidate.family.name)
        return original(self, found, present)

    monkeypatch.setattr(Search, "_shaped", noted)
    search({})
    assert len(shaped) >= len(FEW)


def test_two_runs_give_the_same_bits() -> None:
    hidden: dict[str, object] = {"drive_gain_error": [{"drive": 1, "change": -0.05}]}
    first, second = (answer_json(search(hidden)) for _ in range(2))
    assert first == second
    assert first["findings"][0]["effect"] == "drive_gain_error"


def test_a_motion_that_does_not_repeat_is_searched_all_the_same() -> None:
    fit, other = recorded({}, 0, 2), recorded({}, 1, 3)
    half = fit.time.shape[0] // 2
    once = Recording(
        "once", fit.time[:half], fit.reference[:half], fit.position[:half], fit.control_signal[:half]
    )  # type: ignore[index]
    question = Question(robots.load("emps"), (once,), (other,), FEW, prior)
    answer = diagnose_by_evidence(question)
    assert not answer.repeats
    assert not answer.findings
    assert np.isfinite(answer.log_evidence[0])
