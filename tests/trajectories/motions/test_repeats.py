"""A motion of many periods is judged by one of them and its rows are counted from a few: as the whole."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from ident import base_parameters
from ident.parameters.regressor import RegressorModel
from robots import Robot, load
from trajectories import Judge, TorqueNoise, Trajectory, judgement, plan
from trajectories.constraints.use import largest_use
from trajectories.information.prediction import Prediction
from trajectories.judgement import predicted
from trajectories.motions.motion import MotionSequence, StretchedMotion
from trajectories.motions.repeats import at_most, pieces


@pytest.fixture(scope="module")
def emps() -> Robot:
    return load("emps")


def repeated(arm: Robot, **given: Any) -> Trajectory:
    settings: dict[str, Any] = {"duration": 4.0, "seed": 1, "evaluations": 40, "periods": 5, **given}
    return plan(arm, cycle_time=arm.bus.cycle_time, **settings)


@pytest.mark.parametrize("given", [{}, {"speed": 0.5}, {"family": "fourier"}, {"start": (0.05,)}])
def test_the_pieces_do_whatever_the_whole_motion_does(emps: Robot, given: dict[str, Any]) -> None:
    whole = repeated(emps, **given).motion
    found = pieces(whole)
    assert sum(part.duration for _, part in found) < whole.duration / 2
    judge = Judge(emps)
    told = judge.judge(whole)
    for use, direct in zip(told.uses[-2:], judge.torque.use(whole), strict=True):
        np.testing.assert_allclose(use.share, direct.share, rtol=2e-3)
    assert told.tool.speed == pytest.approx(judge.tool.fastest(whole).speed, rel=1e-3)
    for start, part in found:
        times = np.linspace(0.0, part.duration, 50)[1:-1]
        np.testing.assert_allclose(whole.at(start + times).position, part.at(times).position, atol=1e-9)
    assert at_most(whole, 5).duration == pytest.approx(whole.duration)
    assert at_most(whole, 2).duration < at_most(whole, 3).duration < whole.duration


def test_a_break_in_a_later_part_is_found_with_its_time(emps: Robot) -> None:
    fast = repeated(emps, periods=1).motion
    good = StretchedMotion(fast, 0.5)
    held = Judge(emps)
    assert max(held.torque.use(good)[0].share) < 0.9 * max(held.torque.use(fast)[0].share)
    for order in ((good, good, fast, good), (fast, good, good), (good, fast, good, fast)):
        motion = MotionSequence(order)
        use = largest_use([u for u in held.judge(motion).uses if u.constraint == "torque"])
        direct = held.torque.use(motion)[0]
        np.testing.assert_allclose([use.share, use.time], [direct.share, direct.time], rtol=1e-3)


def test_periods_that_are_not_looked_at_count_as_the_last_one(
    emps: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, base = repeated(emps, periods=9).motion, base_parameters(RegressorModel.of(emps))
    noise = TorqueNoise.white(emps)

    def asked(samples: int) -> Prediction:
        monkeypatch.setattr(judgement, "_SAMPLES", samples)
        return predicted(base, motion, emps.bus.cycle_time, noise)

    whole, counted = asked(100_000), asked(10_000)
    np.testing.assert_allclose(counted.sigma, whole.sigma, rtol=1e-3)
    np.testing.assert_allclose(counted.information.matrix, whole.information.matrix, rtol=1e-3)
    np.testing.assert_allclose(counted.used, whole.used, rtol=1e-3)
    assert counted.rows == pytest.approx(whole.rows, rel=1e-3)
    few = predicted(base, at_most(motion, 3), emps.bus.cycle_time, noise)
    assert (few.sigma > 1.5 * whole.sigma).all()
