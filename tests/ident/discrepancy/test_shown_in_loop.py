"""What the simulated loop says of a finding: each joint by what a simulation leaves there at best."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import robots
from ident import Recording, RegressorModel
from ident.discrepancy.gap import LoopGap, closed_loop_gap
from ident.discrepancy.loop_parts import simulated_with
from ident.discrepancy.validation import LoopRun, Validation
from ident.effects import FrictionSign
from ident.parameters.base import base_parameters

STEP, SAMPLES = 0.01, 3000
NOISE = 1e-6
"""rad, of what does not repeat in the positions."""


VALIDATION = Validation((), cast(Any, None))


def run(errors: np.ndarray) -> LoopRun:
    size = np.sqrt(np.mean(errors**2, axis=0))
    return LoopGap(size, size, (errors,), (STEP * np.arange(SAMPLES),)), ""


def errors(of_first: float, of_second: float) -> np.ndarray:
    """Of the joint whose effect is asked about; of one whose simulation is wrong by much, and by chance."""
    time = STEP * np.arange(SAMPLES)
    first = of_first * NOISE * np.sin(2.0 * time)
    second = NOISE * (300.0 * np.sin(3.0 * time) + of_second * np.sin(3.0 * time + 0.5))
    return np.stack([first, second], axis=1)


@pytest.mark.parametrize(("left", "there"), [(1.0, True), (20.0, False)])
def test_a_joint_that_no_model_simulates_does_not_decide(left: float, there: bool) -> None:
    """At its own joint an effect is there, or is not; elsewhere it moves what is wrong anyway by a tenth."""
    for elsewhere in (-40.0, 40.0):
        whole = errors(left if there else 10.0 + left, elsewhere)
        shown = VALIDATION.shown_in_loop(run(errors(10.0, 0.0)), run(whole))
        assert shown is not None
        assert shown.there is there
        assert shown.contradicted is not there


def test_where_both_simulations_are_exact_there_is_nothing_to_tell() -> None:
    none = run(np.zeros((SAMPLES, 2)))
    shown = VALIDATION.shown_in_loop(none, none)
    assert shown is not None
    assert not shown.there


def test_a_change_that_no_simulation_resolves_is_none() -> None:
    """An integral makes up for a constant torque: of it the positions had −1089 ± 40, and it was refused."""
    for change, nothing in ((0.9e-2, True), (1.1e-2, False)):
        before = errors(10.0, 0.0)
        shown = VALIDATION.shown_in_loop(run(before), run((1.0 + change) * before))
        assert shown is not None
        assert shown.of_nothing is nothing and shown.contradicted is not nothing


def test_an_arm_is_simulated_with_the_friction_at_standstill_that_it_has() -> None:
    """One whose friction turns over 20 mm/s is another than one of bristles, by its positions alone."""
    robot = robots.load("emps")
    base = base_parameters(RegressorModel.of(robot))
    standard = base.model.prior()
    time = np.asarray(robot.controller.sample_time * np.arange(2000), dtype=np.float64)
    reference = (0.02 * (1.0 - np.cos(2.0 * np.pi * time)))[:, np.newaxis]
    described = Recording("arm", time, reference, reference, np.zeros_like(reference))
    law = (FrictionSign("tanh", 0.02),)
    run = simulated_with(base, standard, law, described)
    # The friction that it stood with at the start is nobody's law.
    stood = np.where(time < 0.99, 1e-3, 0.0)[:, np.newaxis]
    recording = Recording("arm", time, reference, run.position + stood, run.control_signal + stood)
    piece = cast(Any, SimpleNamespace(recording=recording))
    same, other = (closed_loop_gap(base, standard, [piece], one)[0] for one in (law, None))
    assert same is not None and other is not None
    assert float(same.position[0]) < 0.01 * float(other.position[0])
    assert float(same.control_signal[0]) < 0.01 * float(other.control_signal[0])
    assert same.time[0][0] == pytest.approx(1.0)
    step = cast(Any, SimpleNamespace(base=base, standard_shown=standard))
    of_it = Validation((piece,), cast(Any, None), law).loop_run(step)[0]
    assert of_it is not None
    assert of_it.position == pytest.approx(same.position)


class _ByTwoLaws(Validation):
    """Errors of two joints by the law that was found, and by the description's."""

    def loop_run(self, step: Any) -> LoopRun:
        left, reason = step[self.standstill is None]
        return (None, reason) if reason else run(np.tile(left, (SAMPLES, 1)))


@pytest.mark.parametrize(
    ("found", "described", "by_found"),
    [
        # Two arms that stick, and a law that the fitted recordings alone have.
        (([4e-5, 2e-5], ""), ([2e-4, 4e-4], ""), True),
        (([2e-4, 4e-4], ""), ([4e-5, 2e-5], ""), False),
        # The nearer by all joints, each by its own size.
        (([1e-6, 3e-3], ""), ([4e-6, 1e-3], ""), True),
        (([1e-6, 5e-3], ""), ([4e-6, 1e-3], ""), False),
        (([0.0, 1e-5], ""), ([1e-6, 1e-5], ""), True),
        # What cannot be simulated by the one is asked of the other.
        (([0.0, 0.0], "too quick"), ([1.0, 1.0], ""), False),
        (([1.0, 1.0], ""), ([0.0, 0.0], "too quick"), True),
    ],
)
def test_a_loop_is_asked_with_the_friction_at_standstill_that_other_recordings_bear_out(
    found: tuple[list[float], str], described: tuple[list[float], str], by_found: bool
) -> None:
    validation = _ByTwoLaws((), cast(Any, None), (FrictionSign("tanh", 0.02),) * 2)
    validation.__dict__["_described"] = _ByTwoLaws((), cast(Any, None))
    likelier = validation.by_likelier_law(cast(Any, (found, described)))
    assert (likelier is validation) is by_found
