"""Effects that joined the vocabulary later: named among those that they pass for, with their sizes."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from drivers.simulated import draw_truth
from drivers.simulated.scenario import Scenario
from ident import Recording
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import (
    diagnose_by_evidence,
    diagnose_with_evidence,
    prior_by_evidence,
)
from ident.discrepancy.by_evidence.report.answer import EvidenceFinding
from ident.effects.vocabulary import confused_with, family_named
from robots.description import Robot
from tests.ident.discrepancy.blind_search import hidden, recorded
from tests.ident.discrepancy.by_evidence.test_search import TRUTH, search

pytestmark = pytest.mark.slow

EMPS = robots.load("emps")
GAIN, LIMIT = float(EMPS.gains[0]), float(EMPS.torque_limits[0])
LARGEST = 3.7
"""Control signal that the motion asks for at most."""


def only(name: str, effect: dict[str, object], robot: Robot = EMPS) -> EvidenceFinding:
    """The one sure finding where this is hidden in the axis, asked for with all names that it passes for."""
    families = [family_named(one) for one in (name, *confused_with(name))]
    answer = search({name: [{"drive": 1, **effect}]}, families=families, robot=robot)
    (found,) = (one for one in answer.findings if one.sure)
    assert (found.name, found.joints) == (name, (1,))
    return found


def values(finding: EvidenceFinding) -> dict[str, tuple[float, float]]:
    """Parameters and shapes with their deviations."""
    return {one.name: (one.value, one.sigma) for one in finding.parameters}


def test_a_torque_constant_that_droops() -> None:
    found = values(only("torque_constant_droop", {"loss": 0.1, "current": LARGEST}))
    # What is asked for beyond the torque at the largest torque: the plant's droop has another form.
    torque = GAIN * LARGEST / 1.1
    more = found["droop1"][0] * (torque / LIMIT) ** found["power"][0]
    assert more == pytest.approx(0.1, rel=0.1)


def test_a_dead_zone_of_the_command() -> None:
    width, sigma = values(only("command_dead_zone", {"width": 0.03}))["dead_zone1"]
    assert width == pytest.approx(0.03 * GAIN, abs=3.0 * sigma)


def test_an_encoder_that_runs_out_of_true() -> None:
    # A screw of 16 mm: once a turn is 10 Hz at full speed. With the axis's own of 2.5 mm it is 60 Hz, beyond
    # what the rows show (100 Hz).
    (drive,) = EMPS.drive
    coarse = EMPS.model_copy(update={"drive": (drive.model_copy(update={"gear": 62.5}),)})
    turns = 2.0 * np.pi * 62.5
    size, phase = 0.003 / turns, 0.4
    scale = {"amplitude": size, "turns": turns, "phase": phase}
    found = values(only("encoder_eccentricity", scale, coarse))
    for name, true in (("reads_cos1", size * np.sin(phase)), ("reads_sin1", size * np.cos(phase))):
        value, sigma = found[name]
        assert value == pytest.approx(true, abs=3.0 * sigma), name


def test_a_brake_that_rubs_now_and_then() -> None:
    found = values(only("dragging_brake", {"rise": 0.6, "period": 3.1, "share": 0.5}))
    coulomb = draw_truth(EMPS, TRUTH).parameters["Fc1"]
    assert found["period"][0] == pytest.approx(3.1, rel=0.01)
    assert found["share"][0] == pytest.approx(0.5, abs=0.02)
    value, sigma = found["drag1"]
    assert value == pytest.approx(0.6 * coulomb, abs=3.0 * sigma) and sigma < 0.1 * value


def test_oil_that_gets_thinner_beside_dry_friction_that_stays() -> None:
    """Named beside drifting friction, of which it is the half that a warm gear's oil has."""
    found = values(only("temperature_viscous_friction", {"start": -10.0, "time_constant": 6.0}))
    viscous = draw_truth(EMPS, TRUTH).parameters["Fv1"]
    # The plant's oil goes exponentially with temperature: the colder it is, the quicker.
    assert found["settling_time"][0] == pytest.approx(6.0, rel=0.1)
    assert found["Fv_oil_cold1"][0] == pytest.approx(viscous * np.expm1(0.015 * 10.0), rel=0.1)


def of_six_axes(name: str, effect: object, joints: tuple[int, ...]) -> EvidenceFinding:
    """The one sure finding on six axes, asked for with all names that it passes for."""
    robot, duration = robots.load("tx40"), 5.0
    scenario = hidden({name: effect})
    accepted = recorded(robot, 78, Scenario(), 0, 1, duration)
    fit, validation = (recorded(robot, 78, scenario, motion, motion + 2, duration) for motion in (0, 1))
    families = tuple(family_named(one) for one in (name, *confused_with(name)))
    question = Question(
        robot, (fit,), (validation,), families, lambda base: prior_by_evidence(base, (accepted,))
    )
    (found,) = (one for one in diagnose_by_evidence(question).findings if one.sure)
    assert (found.name, found.joints) == (name, joints)
    return found


def test_a_dress_pack_that_comes_back_by_another_way() -> None:
    """Of the second axis, which has to carry the arm beside it."""
    pack = {"joint": 2, "slip": 3.0, "bend": 0.3, "stiffness": 4.0, "centre": 0.2}
    found = values(of_six_axes("dress_pack_hysteresis", [pack], (2,)))
    assert found["pack_hysteresis2"][0] == pytest.approx(3.0, rel=0.05)
    assert found["pack_stiffness2"][0] == pytest.approx(4.0, rel=0.1)


def test_a_foot_that_gives_way() -> None:
    found = values(of_six_axes("base_compliance", {"pitch": 5e4, "plate": 0.5}, ()))
    assert found["about"][0] == 1.0
    assert found["compliance"][0] == pytest.approx(1.0 / 5e4, rel=0.1)
    assert found["foot_inertia"][0] == pytest.approx(0.5, abs=0.3)  # beside an arm of 4 kg·m²


def test_a_drive_at_its_limit_where_nothing_repeats() -> None:
    """No other period says what an integrator asked for beyond it: the measured signal does."""

    def once(scenario: dict[str, object], motion: int, seed: int) -> Recording:
        run = recorded(EMPS, TRUTH, hidden(scenario) if scenario else Scenario(), motion, seed, 5.0)
        half = run.time.size // 2
        assert run.reference is not None
        channels = (run.reference, run.position, run.control_signal)
        return Recording(run.name, run.time[:half], *(one[:half] for one in channels))

    limit = 3.0
    limited = {"saturation": [{"drive": 1, "limit": limit}]}
    accepted = recorded(EMPS, TRUTH, Scenario(), 0, 1, 5.0)
    families = tuple(family_named(one) for one in ("saturation", *confused_with("saturation")))
    fit, validation = once(limited, 0, 2), once(limited, 1, 3)
    question = Question(
        EMPS, (fit,), (validation,), families, lambda base: prior_by_evidence(base, (accepted,))
    )
    diagnosis, _ = diagnose_with_evidence(question, sizes=False)
    (found,) = diagnosis.findings
    assert (diagnosis.verdict, found.effect, found.joints) == ("named", "saturation", (1,))
    sizes = {one.name: one.value for one in found.parameters}
    # Rows beyond the limit cost, and a twentieth of five seconds is there: it comes out large.
    assert sizes["torque_limit"] == pytest.approx(limit * GAIN, rel=0.15)
    assert sizes["excess1"] == pytest.approx(1.0, abs=0.1)
