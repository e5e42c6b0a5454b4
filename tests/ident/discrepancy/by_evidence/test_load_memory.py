"""Friction of a load that follows late, or is a share of the motor's torque: named, sized, and then known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from ident import Recording, identify
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import accepted_prior, diagnose_with_evidence
from ident.discrepancy.results import Diagnosis, Finding
from ident.discrepancy.settings import searching
from ident.effects import State
from ident.effects.entry import EffectEntry
from ident.effects.vocabulary import VOCABULARY, effect_from
from ident.identification.found_effects import FoundModel, extended_model
from ident.identification.options import Options
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from tests.ident.discrepancy.blind_search import hidden
from tests.ident.discrepancy.blind_search import recorded as record

EMPS = robots.load("emps")
TRUTH, DURATION = 501, 5.0
PLAIN = EffectEntry("load_dependent_friction", (1,), {"offset_at_link": 1.0})
KNOWN = replace(PLAIN, shape={"offset_at_link": 1.0, "load_memory": 0.005})
TERM = EffectEntry("term: sign q̇₁·|load₁|", (1,), {})


def recorded(effect: str, motion: int, seed: int, **values: float) -> Recording:
    scenario = hidden({effect: [{"drive": 1, **values}]} if effect else {})
    return record(EMPS, TRUTH, scenario, motion, seed, DURATION)


def against_a_clean_arm(effect: str, **values: float) -> Diagnosis:
    estimate = identify(EMPS, (recorded("", 0, 1),)).result.recommended
    both = (recorded(effect, 0, 2, **values),), (recorded(effect, 1, 3, **values),)

    def prior(base):  # type: ignore[no-untyped-def]
        return accepted_prior(estimate.values, estimate.covariance)

    return diagnose_with_evidence(Question(EMPS, *both, VOCABULARY, prior), sizes=False)[0]


def values_of(finding: Finding) -> dict[str, float]:
    return {one.name: one.value for one in finding.parameters}


def test_the_memory_of_a_load_is_part_of_the_effect() -> None:
    """Plain, its rows leave a torque at every change of the load, which was called static friction."""
    found = against_a_clean_arm("load_dependent_friction", coefficient=0.15, time_constant=0.008)
    assert [(one.effect, one.joints) for one in found.findings] == [("load_dependent_friction", (1,))]
    values = values_of(found.findings[0])
    assert values["mu1"] == pytest.approx(0.15, abs=0.01)
    assert values["load_memory"] == pytest.approx(0.008, rel=0.25)


def test_friction_of_the_motors_torque_is_no_directional_efficiency() -> None:
    """mu of L + F is mu/(1 − mu) of L while driving it and mu/(1 + mu) while driven by it."""
    mu = 0.2
    sides = {"driving": mu / (1.0 - mu), "driven": mu / (1.0 + mu)}
    found = against_a_clean_arm("directional_efficiency", **sides, time_constant=1e-4)
    assert [(one.effect, one.joints) for one in found.findings] == [("load_dependent_friction", (1,))]
    values = values_of(found.findings[0])
    assert values["load_friction1"] * values["motor_share"] == pytest.approx(mu, rel=0.1)
    assert found.verdict == "named"


def test_the_motors_side_holds_the_friction_itself() -> None:
    """F = mu·|L + F| against the motion, in both directions of the load."""
    model = RegressorModel.of(EMPS)
    entry = EffectEntry("load_dependent_friction", (1,), {"motor_share": 0.25, "offset_at_link": 1.0})
    present = Present(model, model.prior())
    effect = effect_from(EMPS, entry, present)
    speed, push = np.array([[0.4], [0.4], [-0.4], [-0.4]]), np.array([[3.0], [-3.0], [3.0], [-3.0]])
    state = State(np.zeros((4, 1)), speed, push)
    friction, load = effect.columns(state)[:, 0, 0], present.link_torque(state)[:, 0]
    np.testing.assert_allclose(friction, 0.25 * np.abs(load + friction) * np.sign(speed[:, 0]), rtol=1e-6)


def accepted_and_unchanged(entry: EffectEntry, mu: float, late: float) -> Diagnosis:
    """An arm whose model was fitted with a friction of the load and that is diagnosed again as it is."""
    arm = {"coefficient": mu, "time_constant": late}
    fit = recorded("load_dependent_friction", 2, 7, **arm)
    first = identify(EMPS, (fit,))
    usual = tuple(effect.name for effect in first.base.model.effects)
    values = dict(zip(first.base.names, first.result.recommended.values, strict=True))
    values["mu1" if entry is not TERM else f"{TERM.name.removeprefix('term: ')}@1"] = mu
    model = FoundModel.of("file", (*usual, entry.name), (entry,), values)
    whole = identify(EMPS, (fit,), options=Options(found=model))
    estimate = whole.result.recommended
    model = replace(model, values=dict(zip(whole.base.names, estimate.values, strict=True)))
    both = [(recorded("load_dependent_friction", motion, seed, **arm),) for motion, seed in ((0, 2), (1, 3))]
    extended = extended_model(searching(EMPS, both[0][0]), model)

    def prior(base):  # type: ignore[no-untyped-def]
        return accepted_prior(estimate.values, estimate.covariance)

    question = Question(EMPS, both[0], both[1], VOCABULARY, prior, extended)
    return diagnose_with_evidence(question, sizes=False)[0]


@pytest.mark.parametrize(
    ("entry", "mu", "late"),
    [
        pytest.param(PLAIN, 0.05, 0.005, id="memory unknown"),
        pytest.param(KNOWN, 0.3, 0.005, id="memory known", marks=pytest.mark.slow),
        pytest.param(PLAIN, 0.3, 1e-4, id="no memory", marks=pytest.mark.slow),
        pytest.param(TERM, 0.1, 0.005, id="term", marks=pytest.mark.slow),
    ],
)
def test_an_unchanged_arm_with_friction_of_the_load_is_clean(
    entry: EffectEntry, mu: float, late: float
) -> None:
    found = accepted_and_unchanged(entry, mu, late)
    assert (found.verdict, found.findings) == ("clean", ())
