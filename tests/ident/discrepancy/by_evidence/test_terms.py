"""A term for what has no name: its formula, unit and size, its joint; none on clean arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import robots
from daq.diagnosis.more import more_of
from daq.text.progress import Silent
from drivers.simulated.scenario import Scenario
from ident import Recording, RegressorModel
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import diagnose_with_evidence, prior_by_evidence
from ident.discrepancy.by_evidence.terms import propose as module
from ident.discrepancy.by_evidence.terms.asked import proposed_terms
from ident.discrepancy.by_evidence.terms.proposal import Proposal
from ident.effects import State
from ident.effects.terms import NOTES, dictionary
from ident.effects.usual import friction_sign
from ident.effects.vocabulary import VOCABULARY
from ident.parameters.present import Present
from tests.ident.discrepancy import blind_search

DURATION = 5.0


def recorded(scenario: dict[str, object], truth: int, motion: int, seed: int) -> Recording:
    hidden = blind_search.hidden(scenario) if scenario else Scenario()
    return blind_search.recorded(robots.load("emps"), truth, hidden, motion, seed, DURATION)


def of(fit: Recording, validation: Recording, accepted: Recording) -> Question:
    robot = robots.load("emps")
    return Question(
        robot, (fit,), (validation,), VOCABULARY, lambda base: prior_by_evidence(base, (accepted,))
    )


def asked(fit: Recording, validation: Recording, accepted: Recording) -> tuple[Proposal, ...]:
    return proposed_terms(of(fit, validation, accepted))


def terms(scenario: dict[str, object], truth: int) -> tuple[Proposal, ...]:
    fit, validation = recorded(scenario, truth, 0, 2), recorded(scenario, truth, 1, 3)
    return asked(fit, validation, recorded({}, truth, 0, 1))


@cache
def dragged(motion: int, seed: int) -> Recording:
    """900 N·s²/m² q̇|q̇| put into a recording itself: no plant has it."""
    recording = recorded({}, 501, motion, seed)
    speed = np.gradient(recording.position, recording.sample_time, axis=0)
    signal = recording.control_signal + 900.0 * speed * np.abs(speed) / robots.load("emps").gains
    return replace(recording, control_signal=signal)


def test_a_drag_that_no_name_has_gets_its_power_and_unit_and_a_place_in_the_model() -> None:
    question = replace(of(dragged(0, 2), dragged(1, 3), recorded({}, 501, 0, 1)), families=())
    diagnosis, _ = diagnose_with_evidence(question, sizes=False)
    more = more_of(diagnosis, question, Silent(), power=False)
    found = more.terms
    assert {name for term in found for name in term.variables} == {"v1"}
    first = found[0]
    assert (first.joint, first.formula, first.unit) == (1, "q̇₁·|q̇₁|", "N·s²/m²")
    assert first.value == pytest.approx(900.0, abs=4.0 * first.sigma + 90.0)
    assert first.stability >= module.STABLE
    assert first.after < 0.3 * first.before
    assert "drag" in first.looks_like

    assert diagnosis.verdict == "unnamed" and more.model is not None
    assert more.model.base.names == (*diagnosis.base.names, "q̇₁·|q̇₁|@1")
    assert more.model.beta[-1] == pytest.approx(900.0, abs=4.0 * np.sqrt(more.model.covariance[-1, -1]))
    without, with_term = (
        blind_search.beyond_noise(one.examinations[-1])[0][0] for one in (diagnosis, more.model)
    )
    assert with_term < 0.1 * without
    assert more.model.findings == ()


def test_friction_that_grows_with_the_load_comes_out_as_its_formula() -> None:
    first = terms({"load_dependent_friction": [{"drive": 1, "coefficient": 0.2}]}, 504)[0]
    assert (first.joint, first.formula, first.unit) == (1, "sign q̇₁·|load₁|", "1")
    assert first.value == pytest.approx(0.2, rel=0.1)
    assert first.variables == ("load1", "v1")


@pytest.mark.parametrize("truth", [601, 602, 603, 604])
def test_a_clean_arm_gets_no_term_even_where_one_is_looked_for(
    truth: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ident.discrepancy.by_evidence.terms.asked.ABOVE", -1.0)
    assert terms({}, truth) == ()


def test_what_the_other_recording_does_not_bear_out_is_no_term() -> None:
    accepted = recorded({}, 501, 0, 1)
    assert asked(dragged(0, 2), recorded({}, 501, 1, 3), accepted) == ()


def test_what_halves_of_the_recording_do_not_choose_is_no_term(monkeypatch: pytest.MonkeyPatch) -> None:
    original = module.stability
    asked_of: list[float] = []

    def unstable(*arguments: Any) -> float:
        asked_of.append(original(*arguments))
        return module.STABLE - 0.1

    monkeypatch.setattr(module, "stability", unstable)
    assert asked(dragged(0, 2), dragged(1, 3), recorded({}, 501, 0, 1)) == ()
    assert asked_of


def units(formulas: Sequence[str], arm: str = "tx40", joint: int = 2) -> list[str]:
    known = {term.formula: term.unit for term in dictionary(robots.load(arm), joint)}
    return [known[formula] for formula in formulas]


def test_every_term_has_its_unit_and_a_note() -> None:
    assert units(["q̇₃", "q̇₃·|q̇₃|", "q̇₃³", "sign q̇₃", "q̈₃", "1"]) == [
        "N·m·s/rad",
        "N·m·s²/rad²",
        "N·m·s³/rad³",
        "N·m",
        "N·m·s²/rad",
        "N·m",
    ]
    assert units(["q₃", "q̇₃·q₃", "sign q̇₃·|load₃|", "q̇₃·load₃", "load₃·|load₃|", "q̇₃·|cos 2q₃|"]) == [
        "N·m/rad",
        "N·m·s/rad²",
        "1",
        "s/rad",
        "1/(N·m)",
        "N·m·s/rad",
    ]
    assert units(["t", "q̇₃·t", "q̇₄", "q̈₄"]) == ["N·m/s", "N·m/rad", "N·m·s/rad", "N·m·s²/rad"]
    assert units(["q̇₁·|q̇₁|", "sign q̇₁·√|q̇₁|"], "emps", 0) == ["N·s²/m²", "N·s^½/m^½"]
    assert units(["max(q₃ − 0.482, 0)", "z(q₃/0.24)", "τ₃³", "sign q̇₃·exp(−t/5)"]) == [
        "N·m/rad",
        "N·m",
        "1/(N·m)²",
        "N·m",
    ]
    assert units(["q̇₃·|q̇₃|·q₃", "q̇₃·|q̇₃|·|q₃|", "q₃·t", "q₃·exp(−t/20)"]) == [
        "N·m·s²/rad³",
        "N·m·s²/rad³",
        "N·m/(s·rad)",
        "N·m/rad",
    ]
    for arm in ("tx40", "emps"):
        robot = robots.load(arm)
        for joint in range(robot.n):
            made = dictionary(robot, joint)
            assert {term.kind for term in made} <= set(NOTES)
            assert len({term.formula for term in made}) == len(made)


def test_a_bristle_is_drawn_along_its_way_and_has_position_and_direction() -> None:
    robot = robots.load("tx40")
    (term,) = (one for one in dictionary(robot, 2) if one.formula == "z(q₃/0.24)")
    assert term.variables == {"q3", "v3"}
    model = RegressorModel.of(robot)
    still = np.zeros((3, robot.n))
    q = still.copy()
    q[:, 2] = [0.0, 0.24, 0.0]
    forth, back = term.value(State(q, still, still, np.arange(3.0)), Present(model, model.prior()))[1:]
    assert forth == pytest.approx(1.0 - np.exp(-1.0))
    assert back == pytest.approx(-1.0 + (1.0 + forth) * np.exp(-1.0))


def test_a_formula_is_what_it_says_and_its_scale_is_a_dry_friction() -> None:
    robot = robots.load("tx40")
    random = np.random.default_rng(5)
    q, v, a = random.normal(size=(3, 20, robot.n))
    model = RegressorModel.of(robot)
    present = Present(model, model.prior())
    state = State(q, v, a, np.arange(20.0))
    made = {term.formula: term for term in dictionary(robot, 2)}
    load = present.link_torque(state)[:, 2]
    expected = {
        "q̇₃·|q̇₃|": v[:, 2] * np.abs(v[:, 2]),
        "q̇₃·|cos 2q₃|": v[:, 2] * np.abs(np.cos(2 * q[:, 2])),
        "q̇₃·|load₃|": v[:, 2] * np.abs(load),
        "q̇₄": v[:, 3],
        "q̇₃·t": v[:, 2] * np.arange(20.0),
        "1": np.ones(20),
        "sign q̇₃·√|q̇₃|": friction_sign(robot)(v[:, 2]) * np.sqrt(np.abs(v[:, 2])),
        "sign q̇₃·exp(−|q̇₃|/0.45)": friction_sign(robot)(v[:, 2]) * np.exp(-np.abs(v[:, 2]) / 0.45),
        "max(q₃ − 0.482, 0)": np.maximum(q[:, 2] - 0.482, 0.0),
        "max(−0.482 − q₃, 0)": np.maximum(-0.482 - q[:, 2], 0.0),
        "q̇₃·exp(−t/20)": v[:, 2] * np.exp(-np.arange(20.0) / 20.0),
        "τ₃³": present.torque(state)[:, 2] ** 3,
    }
    for formula, values in expected.items():
        assert made[formula].value(state, present) == pytest.approx(values)
    friction = max(robot.drive[2].dynamics.coulomb, 0.02 * robot.joint[2].torque)
    assert made["sign q̇₃"].scale == pytest.approx(friction)
    assert made["q̇₃"].scale == pytest.approx(friction / (0.5 * robot.joint[2].velocity))
