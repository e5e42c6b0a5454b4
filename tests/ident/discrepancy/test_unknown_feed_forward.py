"""What a controller adds beside its described law is measured, whatever the arm is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robots
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.offline import simulate_offline
from ident import Recording, RegressorModel
from ident.closed_loop import simulate
from ident.discrepancy.unknown_feed_forward import with_feed_forward
from robots.arrays import FloatArray

ROBOT = robots.load("emps")
START = 1000
"""Samples of the settling."""


@cache
def led() -> Recording:
    run = simulate_offline(ROBOT, draw_truth(ROBOT, 3), exercise(ROBOT, duration=5.0), periods=2, seed=1)
    return Recording("led", run.time, run.reference, run.position, run.control_signal)


def recorded(fed: FloatArray | None, heavier: float = 1.0) -> Recording:
    """What another arm does of the same motion, whose controller adds something that is not said."""
    model = RegressorModel.of(ROBOT)
    run = simulate(model, heavier * model.prior(), replace(led(), added=fed))
    noise = 1e-3 * np.random.default_rng(1).normal(size=run.control_signal.shape)
    return replace(led(), position=run.position, control_signal=run.control_signal + noise)


def computed(share: float) -> FloatArray:
    """Of the rated control signal, along the motion's acceleration."""
    assert led().reference is not None
    rate = np.gradient(np.gradient(led().reference, axis=0), axis=0)
    period = rate.shape[0] // 2
    rate = np.tile(rate[period : 2 * period], (3, 1))[: rate.shape[0]]
    return np.asarray(share * ROBOT.controller.saturation[0] * rate / np.abs(rate).max())


@pytest.mark.parametrize("heavier", [1.0, 1.4])
def test_it_is_measured_whatever_the_arm_is(heavier: float) -> None:
    fed = computed(0.1)
    (found,), (words,) = with_feed_forward(ROBOT, [recorded(fed, heavier)])
    assert found.added is not None
    left = (found.added - fed)[START:]
    left -= left.mean(axis=0)
    assert float(left.std()) < 0.05 * float(fed[START:].std())
    assert "unknown feed-forward" in words and "on drive 1" in words and "simulated with" in words


def test_the_simulated_bench_adds_nothing() -> None:
    assert with_feed_forward(ROBOT, [led()]) == ((led(),), ())


@pytest.mark.parametrize("heavier", [1.0, 1.4])
def test_a_described_controller_adds_nothing_whatever_the_arm_is(heavier: float) -> None:
    recording = recorded(None, heavier)
    assert with_feed_forward(ROBOT, [recording]) == ((recording,), ())


def test_what_is_known_of_it_is_no_part_of_it() -> None:
    fed = computed(0.1)
    known = replace(recorded(fed), added=fed)
    assert with_feed_forward(ROBOT, [known]) == ((known,), ())
    (found,), _ = with_feed_forward(ROBOT, [recorded(fed)])
    assert with_feed_forward(ROBOT, [found]) == ((found,), ())


def test_where_nothing_repeats_it_is_said_and_not_simulated() -> None:
    fed = computed(0.1)
    once = recorded(fed).piece(slice(led().time.shape[0] * 3 // 5))
    (found,), (words,) = with_feed_forward(ROBOT, [once])
    assert found.added is None
    assert "nothing repeats" in words


def test_a_motion_that_repeats_tells_it_for_one_that_does_not() -> None:
    whole = recorded(computed(0.1))
    once = whole.piece(slice(led().time.shape[0] * 3 // 5))
    (_, found), (words,) = with_feed_forward(ROBOT, [whole, once])
    assert found.added is not None and "nothing repeats" not in words


def test_more_than_a_joint_can_do_is_another_law() -> None:
    recording = recorded(None)
    gains = tuple(50.0 * gain for gain in ROBOT.controller.position_gain)
    wrong = ROBOT.controller.model_copy(update={"position_gain": gains})
    robot = ROBOT.model_copy(update={"controller": wrong})
    assert with_feed_forward(robot, [recording]) == ((recording,), ())
