"""Fourier motions: exact derivatives, bounds between samples, and the same interface as the waypoints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots import load
from trajectories import PlanError, plan
from trajectories.limits import Limits
from trajectories.motions.fourier import FourierMotion


def random_series(seed: int, periods: int = 1) -> FourierMotion:
    generator = np.random.default_rng(seed)
    harmonics, joints = int(generator.integers(1, 7)), int(generator.integers(1, 5))
    sine, cosine = generator.standard_normal((2, harmonics, joints)) * 10.0 ** generator.uniform(-2, 1)
    return FourierMotion(
        generator.uniform(0.5, 20.0), periods, generator.standard_normal(joints), sine, cosine
    )


@given(st.integers(0, 2**32 - 1))
def test_extremes_bound_every_state_closely(seed: int) -> None:
    motion = random_series(seed)
    extremes = motion.extremes()
    dense = motion.at(np.linspace(0.0, motion.duration, 10_001))
    travel = extremes.highest - extremes.lowest
    assert (dense.position.max(axis=0) <= extremes.highest).all()
    assert (dense.position.min(axis=0) >= extremes.lowest).all()
    assert (extremes.highest - dense.position.max(axis=0) <= 0.01 * travel).all()
    for name in ("velocity", "acceleration", "jerk"):
        largest, bound = np.abs(getattr(dense, name)).max(axis=0), getattr(extremes, name)
        assert (largest <= bound).all(), name
        assert (bound <= 1.05 * largest).all(), name


def test_derivatives_are_those_of_the_position() -> None:
    motion, step = random_series(5), 1e-5
    time = np.linspace(0.0, motion.duration, 100)
    for name, derivative in (
        ("position", "velocity"),
        ("velocity", "acceleration"),
        ("acceleration", "jerk"),
    ):
        ahead, behind = (getattr(motion.at(time + sign * step), name) for sign in (1, -1))
        expected = getattr(motion.at(time), derivative)
        np.testing.assert_allclose(
            (ahead - behind) / (2 * step), expected, atol=1e-5 * np.abs(expected).max()
        )


def test_a_series_may_begin_later_with_the_same_extremes() -> None:
    motion = random_series(6)
    time = np.linspace(0.0, 3.0, 50)
    np.testing.assert_allclose(motion.begun(0.7).at(time).position, motion.at(time + 0.7).position, atol=1e-9)
    np.testing.assert_allclose(motion.begun(0.7).extremes().highest, motion.extremes().highest, atol=1e-9)


@pytest.mark.parametrize("name", ["tx40", "emps"])
def test_the_plan_rests_at_both_ends_and_keeps_every_limit_in_between(name: str) -> None:
    robot = load(name)
    trajectory = plan(robot, cycle_time=0.004, duration=10.0, seed=2, family="fourier", evaluations=120)
    assert trajectory.family == "fourier" and trajectory.duration == pytest.approx(10.0)
    np.testing.assert_allclose(trajectory.position[[0, -1]], [robot.home, robot.home], atol=1e-8)
    assert np.abs(trajectory.velocity[[0, -1]]).max() < 1e-7
    limits = Limits.of(robot)
    dense = trajectory.at(np.arange(0.0, 10.0, 0.0002))
    assert (dense.position >= limits.lower - 1e-6).all() and (dense.position <= limits.upper + 1e-6).all()
    for quantity in ("velocity", "acceleration", "jerk"):
        assert (np.abs(getattr(dense, quantity)) <= getattr(limits, quantity) * (1 + 1e-6)).all(), quantity
    for quantity, derivative in (("position", "velocity"), ("velocity", "acceleration")):
        jump = np.abs(np.diff(getattr(dense, quantity), axis=0)).max(axis=0)
        assert (jump <= 0.0002 * getattr(limits, derivative) * 1.01).all(), quantity
    assert all((use.share <= 1 + 1e-6).all() for use in trajectory.detail.uses)


def test_periods_repeat_what_lies_between_lead_in_and_lead_out() -> None:
    robot = load("emps")
    once, thrice = (
        plan(robot, cycle_time=0.01, duration=5.0, seed=2, family="fourier", evaluations=60, periods=periods)
        for periods in (1, 3)
    )
    assert thrice.repeat is not None
    period = thrice.repeat.period
    assert period / 0.01 == pytest.approx(round(period / 0.01), abs=1e-6)
    # The planned periods are made a whole number of cycles, by less than one cycle each.
    assert 0.0 <= thrice.duration - once.duration - 2 * period < 2 * 0.01
    inside = np.linspace(1.5, 1.5 + period, 40)
    np.testing.assert_allclose(thrice.at(inside).position, thrice.at(inside + period).position, atol=1e-9)


def test_a_seed_repeats_exactly_and_another_differs() -> None:
    first, again, other = (
        plan(load("emps"), cycle_time=0.01, duration=5.0, seed=seed, family="fourier", evaluations=60)
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.position, again.position)
    assert not np.array_equal(first.position, other.position)


def test_a_period_too_short_for_the_lead_in_is_named() -> None:
    with pytest.raises(PlanError, match="leave no period between lead-in and lead-out") as refused:
        plan(load("emps"), cycle_time=0.01, duration=0.5, seed=1, family="fourier")
    assert refused.value.constraint == "duration"
