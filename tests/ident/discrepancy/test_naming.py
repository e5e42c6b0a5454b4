"""Blind: the plant has an effect that the search is not told of; the search names it, its place and its size.

A short form of benchmarks/naming.py. The plant shares no code with the effects of the vocabulary. A payload
and an unchanged arm are asked about on another engine (tests/daq/diagnosis/test_mujoco_arm.py).
"""

from __future__ import annotations

from functools import cache

import pytest

import robots
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording
from ident.discrepancy import Diagnosis, Prior, Question
from ident.discrepancy.by_evidence import diagnose_with_evidence, prior_by_evidence
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from tests.ident.discrepancy import blind_search

ARM_SEED = 41


@cache
def arm() -> Robot:
    return robots.load("tx40")


def recorded(scenario: Scenario, motion: int, seed: int) -> Recording:
    return blind_search.recorded(arm(), ARM_SEED, scenario, motion, seed, 8.0)


@cache
def accepted() -> Recording:
    """The same arm from before, when nothing was hidden."""
    return recorded(Scenario(), 0, 1)


def search(scenario: dict[str, object]) -> Diagnosis:
    hidden = blind_search.hidden(scenario)

    def prior(base: BaseParameters) -> Prior:
        return prior_by_evidence(base, (accepted(),))

    question = Question(arm(), (recorded(hidden, 0, 2),), (recorded(hidden, 1, 3),), VOCABULARY, prior)
    return diagnose_with_evidence(question, sizes=False)[0]


def named(found: Diagnosis) -> tuple[str, tuple[int, ...]]:
    assert found.findings, found.description
    return found.findings[0].effect, found.findings[0].joints


def value(found: Diagnosis, name: str) -> tuple[float, float]:
    parameter = next(p for p in found.findings[0].parameters if p.name == name)
    return parameter.value, parameter.sigma


@pytest.mark.slow
def test_a_lost_drive_gain_is_found() -> None:
    found = search({"drive_gain_error": [{"drive": 2, "change": -0.05}]})
    assert named(found) == ("drive_gain_error", (2,))
    assert value(found, "gain_error2")[0] == pytest.approx(-0.05 / 0.95, abs=0.004)


@pytest.mark.slow
def test_stribeck_friction_is_found_after_a_refit_too() -> None:
    hidden = Scenario.from_dict(
        {"format": 1, "stribeck_friction": [{"drive": 3, "rise": 0.5, "speed": 0.12}]}
    )
    question = Question(arm(), (recorded(hidden, 0, 2),), (recorded(hidden, 1, 3),), VOCABULARY)
    found, _ = diagnose_with_evidence(question, sizes=False)
    assert named(found) == ("stribeck_friction", (3,))
    assert found.findings[0].mode == "refit"
    assert value(found, "stribeck_speed")[0] == pytest.approx(0.12, rel=0.15)
    assert found.findings[0].gap.after[2] < 0.5 * found.findings[0].gap.before[2] + found.torque.floor[2]


@pytest.mark.slow
def test_a_gear_that_warms_itself_is_found_with_its_time() -> None:
    """As warm as its surroundings at the start: nothing settles, the friction follows the motion's power."""
    heated = {"drive": 3, "time_constant": 6.0, "heating": 3.0}
    found = search({"drifting_friction": [heated]})
    assert named(found) == ("drifting_friction", (3,))
    time, sigma = value(found, "settling_time")
    assert time == pytest.approx(6.0, abs=3 * sigma)
    assert sigma < 1.5
    share, sigma = value(found, "Fv_heat3")
    assert share < -5 * sigma
    assert found.findings[0].held_out_gain > 0.9


@pytest.mark.slow
def test_static_friction_is_found_at_the_reversals() -> None:
    """One that holds over 0.4 mrad is not: the law of a drive that sticks is fitted in its place."""
    found = search({"static_friction": [{"drive": 3, "speed": 0.005, "rise": 1.0, "displacement": 2e-5}]})
    assert named(found) == ("static_friction", (3,))
    assert len(found.findings) == 1
    gap = found.findings[0].gap
    before, after, floor = (part[2] for part in (gap.before, gap.after, gap.floor))
    assert (after - floor) < 0.7 * (before - floor)


@pytest.mark.slow
def test_a_constant_offset_may_be_friction_that_differs_with_the_direction() -> None:
    found = search({"current_offset": [{"drive": 3, "torque": 1.0}]})
    assert found.verdict == "ambiguous"
    names = {found.findings[0].effect, *(c.effect for c in found.findings[0].indistinguishable_from)}
    assert names == {"current_offset", "asymmetric_friction"}


@pytest.mark.slow
def test_a_vibration_has_no_name_and_is_said() -> None:
    found = search({"vibration": [{"joint": 2, "amplitude": 1.0, "frequency": 11.7}]})
    assert found.verdict == "unnamed"
    assert not found.findings
    assert any("11." in item.sentence for item in found.unrepeated)
