"""Where nothing repeats the simulated loop shows the motion without the noise that stands in the torque."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from ident import Recording, RegressorModel
from ident.closed_loop import simulate
from ident.discrepancy.by_evidence.decide import beside_motion
from ident.discrepancy.by_evidence.decide.instruments import fitted_motion, prepared_beside
from ident.discrepancy.by_evidence.evidence.prepared import Prepared, settings_for
from ident.effects.family import PlacedEffect
from ident.effects.vocabulary import form_of
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.present import Present
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.test_search import recorded

EMPS = robots.load("emps")


@cache
def once(seed: int) -> Recording:
    """The first of two periods: the same set-points for each seed, other noise."""
    whole = recorded({}, 0, seed)
    return whole.piece(slice(whole.time.shape[0] * 3 // 5))


@cache
def base() -> BaseParameters:
    return base_parameters(RegressorModel.of(settings_for(EMPS, once(2))))


def fitted(log: Recording) -> Prepared:
    return fitted_motion(base(), None, [log])


def of_noise(first: FloatArray, second: FloatArray, noise: FloatArray) -> float:
    """Share of one run's noise, less another's, in what two prepared runs differ by."""
    return float(np.sum((first - second) * noise) / np.sum(noise**2))


def test_the_motion_of_columns_has_none_of_the_noise_that_moved_the_arm() -> None:
    one, other = (fitted(once(seed)).parts[0] for seed in (2, 5))
    assert one.simulated and one.period is None
    noise = one.own.acceleration - other.own.acceleration
    assert of_noise(one.own.acceleration, other.own.acceleration, noise) == pytest.approx(1.0)
    assert abs(of_noise(one.at_rows.acceleration, other.at_rows.acceleration, noise)) < 0.02


def test_it_is_the_motion_all_the_same() -> None:
    part = fitted(once(2)).parts[0]
    for name, most in (("position", 1e-3), ("velocity", 0.01), ("acceleration", 0.05)):
        own, found = getattr(part.own, name), getattr(part.at_rows, name)
        assert float(np.std((found - own)[part.used])) < most * float(np.std(own[part.used])), name
    assert part.at_rows.measured is not None
    np.testing.assert_array_equal(part.at_rows.measured.position, part.own.position)


def test_no_column_of_a_rate_needs_a_filter_of_its_own_then() -> None:
    assert fitted(once(2)).apart
    whole = recorded({}, 0, 2)
    assert fitted(whole).apart and not fitted(whole).parts[0].simulated


def test_what_cannot_be_simulated_keeps_its_own_motion() -> None:
    log = replace(once(2), reference=None)
    prepared = fitted(log)
    assert not prepared.apart
    assert np.array_equal(prepared.parts[0].at_rows.acceleration, prepared.parts[0].own.acceleration)


def test_what_the_controller_adds_is_in_the_simulated_motion() -> None:
    model = RegressorModel.of(EMPS)
    beta = base().regroup(model.prior())
    log = once(2)
    assert log.reference is not None
    rate = np.gradient(np.gradient(log.reference, axis=0), axis=0)
    fed = 0.2 * EMPS.controller.saturation[0] * rate / np.abs(rate).max()
    run = simulate(model, model.prior(), replace(log, added=fed))
    led = replace(log, position=run.position, control_signal=run.control_signal)
    part = prepared_beside(base(), beta, [led]).parts[0]
    left = float(np.std(part.at_rows.position - part.own.position))
    followed = float(np.std(log.reference - led.position))
    assert left < 0.02 * followed


def delayed() -> tuple[PlacedEffect, FloatArray]:
    """A delay of 3 ms, as a model has it."""
    model, form = RegressorModel.of(EMPS), form_of(EMPS, "time_delay", ("ahead",))
    present = Present(model, model.prior())
    return form.effect(EMPS, form.places(EMPS)[0], (0.003,), present), np.array([0.003])


def test_once_something_is_found_the_motion_is_that_of_an_arm_that_has_it() -> None:
    model, (effect, values) = RegressorModel.of(EMPS), delayed()
    whole = RegressorModel(EMPS, (*model.effects, effect))
    run = simulate(whole, np.append(model.prior(), values), once(2))
    late = replace(once(2), position=run.position, control_signal=run.control_signal)
    beta = base().regroup(model.prior())
    parts = (prepared_beside(base(), beta, [late], beside).parts[0] for beside in ((), ((effect, values),)))
    without, beside = (float(np.abs(part.at_rows.position - part.own.position).max()) for part in parts)
    assert beside < 0.05 * without


def test_a_loop_that_is_farther_from_the_arm_with_what_was_found_is_simulated_without_it() -> None:
    """A delay that makes the simulated loop ring, where the arm's does not, had 88 % of a joint's torque."""
    model, found = RegressorModel.of(EMPS), delayed()
    run = simulate(model, model.prior(), once(2))
    log = replace(once(2), position=run.position, control_signal=run.control_signal)
    beta = base().regroup(model.prior())
    without, beside = (prepared_beside(base(), beta, [log], one).parts[0] for one in ((), (found,)))
    assert np.array_equal(without.at_rows.position, beside.at_rows.position)


@pytest.mark.parametrize(("simulated", "found", "runs"), [(True, "lag", 2), (True, "", 1), (False, "lag", 1)])
def test_a_search_beside_a_simulated_motion_is_asked_again_beside_that_of_what_it_found(
    monkeypatch: pytest.MonkeyPatch, simulated: bool, found: str, runs: int
) -> None:
    asked: list[Any] = []

    class Run:
        wanted = ()

        def __init__(self, problem: Any, wanted: Any, progress: Any) -> None:
            self.problem = problem

        def run(self) -> Any:
            asked.append(self.problem)
            return SimpleNamespace(found=SimpleNamespace(members=(found,) if found else ()))

    part = SimpleNamespace(simulated=simulated)
    problem: Any = SimpleNamespace(base=None, prior=None, prepared=SimpleNamespace(robot=EMPS, parts=(part,)))
    for name, other in (
        ("Search", Run),
        ("with_found", lambda problem, found, recordings: f"motion with {found.members[0]}"),
        ("pose", lambda base, prior, prepared, accepted: prepared),
    ):
        monkeypatch.setattr(beside_motion, name, other)
    question: Any = SimpleNamespace(families=(), fit=())
    search, _ = beside_motion.searched_beside_motion(problem, question, lambda step, share: None)
    assert asked == [problem, "motion with lag"][:runs]
    assert search.problem is asked[-1]
