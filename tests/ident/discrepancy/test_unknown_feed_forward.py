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
from robots import Robot
from robots.arrays import FloatArray

ROBOT = robots.load("emps")
START = 1000
"""Samples of the settling."""

_SPOILED = 100
"""Samples at the end of a record that a filter of set-points spoils."""


@cache
def led() -> Recording:
    run = simulate_offline(ROBOT, draw_truth(ROBOT, 3), exercise(ROBOT, duration=5.0), periods=2, seed=1)
    return Recording("led", run.time, run.reference, run.position, run.control_signal)


def limited(integral: float) -> Robot:
    """The arm with a drive that comes to its limit, 2.5 of 3.5 that it asks for, and an integral gain."""
    changed = {"saturation": (2.5,), "integral_gain": (integral,)}
    return ROBOT.model_copy(update={"controller": ROBOT.controller.model_copy(update=changed)})


def recorded(
    fed: FloatArray | None, heavier: float = 1.0, noise: float = 1e-3, robot: Robot = ROBOT
) -> Recording:
    """What another arm does of the same motion, whose controller adds something that is not said."""
    model = RegressorModel.of(robot)
    run = simulate(model, heavier * model.prior(), replace(led(), added=fed))
    noisy = run.control_signal + noise * np.random.default_rng(1).normal(size=run.control_signal.shape)
    return replace(led(), position=run.position, control_signal=noisy)


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
    assert words.endswith("[controller] of robot.toml is not the arm's: `armhil controller` identifies it")


def test_the_simulated_bench_adds_nothing() -> None:
    assert with_feed_forward(ROBOT, [led()]) == ((led(),), ())


@pytest.mark.parametrize("heavier", [1.0, 1.4])
def test_a_described_controller_adds_nothing_whatever_the_arm_is(heavier: float) -> None:
    recording = recorded(None, heavier)
    assert with_feed_forward(ROBOT, [recording]) == ((recording,), ())


@pytest.mark.parametrize("integral", [0.0, 30.0])
def test_a_drive_at_its_limit_adds_nothing(integral: float) -> None:
    """Its signal there is the limit, and its integral did not go on, which the record does not say."""
    robot = limited(integral)
    recording = recorded(None, robot=robot)
    assert np.mean(np.abs(recording.control_signal) > 2.49) > 0.01
    assert with_feed_forward(robot, [recording]) == ((recording,), ())


@pytest.mark.parametrize("integral", [0.0, 30.0])
def test_it_is_measured_beside_a_limit(integral: float) -> None:
    fed, robot = computed(0.1), limited(integral)
    (found,), _ = with_feed_forward(robot, [recorded(fed, robot=robot)])
    assert found.added is not None
    left = (found.added - fed)[START:]
    assert float((left - left.mean(axis=0)).std()) < 0.1 * float(fed[START:].std())


def test_what_is_known_of_it_is_no_part_of_it() -> None:
    fed = computed(0.1)
    known = replace(recorded(fed), added=fed)
    assert with_feed_forward(ROBOT, [known]) == ((known,), ())
    (found,), _ = with_feed_forward(ROBOT, [recorded(fed)])
    assert with_feed_forward(ROBOT, [found]) == ((found,), ())


def test_where_nothing_repeats_it_is_simulated_without_the_noise_of_the_record() -> None:
    """A loop without it is that of another arm, and would speak against whatever is found on this one."""
    fed, noise = computed(0.1), 0.01
    part = slice(led().time.shape[0] * 3 // 5)
    one, other = (
        with_feed_forward(ROBOT, [recorded(fed, noise=size).piece(part)])[0][0].added for size in (0.0, noise)
    )
    assert one is not None and other is not None
    left = (one - fed[part])[START:-_SPOILED]
    assert float((left - left.mean(axis=0)).std()) < 0.05 * float(fed[START:].std())
    assert float((one - other).std()) < 0.1 * noise


def test_a_motion_that_repeats_tells_it_for_one_that_does_not() -> None:
    whole = recorded(computed(0.1))
    once = whole.piece(slice(led().time.shape[0] * 3 // 5))
    (_, found), _ = with_feed_forward(ROBOT, [whole, once])
    assert found.added is not None


def test_more_than_a_joint_can_do_is_another_law() -> None:
    recording = recorded(None)
    gains = tuple(50.0 * gain for gain in ROBOT.controller.position_gain)
    wrong = ROBOT.controller.model_copy(update={"position_gain": gains})
    robot = ROBOT.model_copy(update={"controller": wrong})
    assert with_feed_forward(robot, [recording]) == ((recording,), ())
