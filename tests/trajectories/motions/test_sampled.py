"""Motions of which only samples are known: never refused for what they keep, refused for what they break."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.trajectories.motions.test_segments import random_chain
from trajectories import TrajectoryError
from trajectories.motions.sampled import sampled_motion
from trajectories.motions.segments import join


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0005, 0.001, 0.004]), st.sampled_from([None, 6, 9, 12]))
@settings(max_examples=30, deadline=None)
def test_a_motion_that_uses_all_of_its_limits_is_not_refused(
    seed: int, step: float, digits: int | None
) -> None:
    _, _, parts = random_chain(seed)
    if not parts:
        return
    motion = join(parts)
    time = np.arange(0.0, motion.duration, step)
    if not 8 <= len(time) < 8_000:
        return
    position = motion.at(time).position
    if digits is not None:
        position = np.round(position, digits)
    exact, found = motion.extremes(), sampled_motion(time, position).extremes()
    for name in ("velocity", "acceleration", "jerk"):
        assert (getattr(found, name) <= getattr(exact, name) * (1 + 1e-6) + 1e-9).all(), name


SLOPE = 0.1 * np.sqrt(2.0)
"""rad/s; positions along it have as many digits as there are."""


def test_a_jump_in_velocity_shows_as_jerk_and_acceleration() -> None:
    time = np.arange(0.0, 1.0, 0.001)
    position = np.where(time < 0.5, 0.0, SLOPE * (time - 0.5))[:, np.newaxis]
    extremes = sampled_motion(time, position).extremes()
    assert extremes.acceleration[0] == pytest.approx(SLOPE / 0.001, rel=1e-6)
    assert extremes.jerk[0] == pytest.approx(SLOPE / 0.001**2, rel=1e-6)
    assert extremes.acceleration_time[0] == pytest.approx(0.5, abs=0.002)
    assert extremes.velocity[0] == pytest.approx(SLOPE)


@pytest.mark.parametrize(("digits", "resolution"), [(3, 1e-3), (6, 1e-6), (9, 1e-9)])
def test_rounding_is_found_and_what_it_hides_is_told(digits: int, resolution: float) -> None:
    time = np.arange(0.0, 2.0, 0.004)
    motion = sampled_motion(time, np.round(np.sin(time), digits)[:, np.newaxis])
    assert motion.resolution == pytest.approx(resolution)
    assert motion.jerk_rounding == pytest.approx(4 * resolution / 0.004**3)
    assert motion.extremes().jerk[0] <= 1.001


def test_full_precision_hides_nothing() -> None:
    time = np.arange(0.0, 2.0, 0.004)
    assert sampled_motion(time, np.sin(time)[:, np.newaxis]).jerk_rounding < 1e-5


def test_uneven_times_are_named() -> None:
    time = np.arange(20) * 0.01
    time[7:] += 0.005
    with pytest.raises(TrajectoryError, match=r"^samples are not evenly spaced: 0\.015 s to the next one"):
        sampled_motion(time, np.zeros((20, 1)))
