"""Stuck samples are set aside, clipped channels said, and arms that rest are left alone."""

from __future__ import annotations

import numpy as np
import pytest

from ident.preparation.held import clipped, not_held, repeated
from robots.arrays import FloatArray

TIME = np.arange(3000) * 0.002
MOVING = np.stack([0.5 * np.sin(2 * np.pi * 0.8 * TIME), 0.3 * np.cos(2 * np.pi * 1.1 * TIME)], axis=1)
NOISE = np.random.default_rng(1).standard_normal(MOVING.shape)


def test_a_stuck_position_is_set_aside_and_said() -> None:
    values = MOVING + 1e-6 * NOISE
    values[1000:1040, 1] = values[1000, 1]
    good, words = not_held("log", "position", TIME, values, values)
    assert np.flatnonzero(~good).tolist() == list(range(1001, 1040))
    assert words == (
        "log: position of joint 2 is stuck for 40 samples after 2 s (1 times in all), set aside",
    )


def test_an_arm_at_rest_is_no_stuck_one() -> None:
    """Rests between smooth motions, with an encoder that shows the same count all the while."""
    phase = np.clip((TIME % 2.0) / 1.2, 0.0, 1.0)
    smooth = 10 * phase**3 - 15 * phase**4 + 6 * phase**5
    counts = np.round(np.where(TIME % 4.0 < 2.0, smooth, 1 - smooth) / 1e-4) * 1e-4
    good, words = not_held("log", "position", TIME, counts[:, np.newaxis], counts)
    assert good.all()
    assert words == ()


def test_a_stuck_torque_is_set_aside() -> None:
    values = 5 * MOVING + 0.1 * NOISE
    values[500:560, 0] = values[500, 0]
    good, words = not_held("log", "control signal", TIME, values, MOVING)
    assert np.count_nonzero(~good) == 59
    assert "control signal of joint 1 is stuck for 60 samples after 1 s" in words[0]


def test_an_arm_at_rest_may_hold_its_torque() -> None:
    resting, values = MOVING.copy(), 5 * MOVING + 0.1 * NOISE
    resting[500:560], values[500:560] = resting[500], values[500]
    good, words = not_held("log", "control signal", TIME, values, resting)
    assert good.all()
    assert words == ()


def test_a_coarse_torque_is_left_alone() -> None:
    values = np.round(5 * MOVING + 0.1 * NOISE)
    good, _ = not_held("log", "control signal", TIME, values, MOVING)
    assert good.all()
    assert clipped("log", "control signal", values) == ()


@pytest.mark.parametrize("digits", [3, 17])
def test_a_clipped_torque_is_said(digits: int) -> None:
    values = np.clip(np.round(5 * MOVING + 0.1 * NOISE, digits), -1e3, 2.0)
    (words,) = clipped("log", "control signal", values[:, :1])
    assert "control signal of joint 1 is 2 at" in words and "was it clipped?" in words
    assert clipped("log", "control signal", np.round(5 * MOVING + 0.1 * NOISE, digits)) == ()
    good, _ = not_held("log", "control signal", TIME, values, MOVING)
    assert good.all()


def read_again(samples: int = 700, joints: int = 3) -> tuple[FloatArray, list[int]]:
    """A source of 34 ms that is read every 33 ms: some of its samples are met twice. And which."""
    lot = np.random.default_rng(8)
    taken = 0.034 * np.arange(samples)
    q = sum(np.sin(2 * np.pi * lot.uniform(0.1, 0.5, joints) * taken[:, np.newaxis] + k) for k in range(3))
    reading = np.minimum((0.033 * np.arange(samples) / 0.034).astype(int), samples - 1)
    return np.asarray(q)[reading], (np.flatnonzero(np.diff(reading) == 0) + 1).tolist()


def test_samples_that_are_read_again_are_told() -> None:
    position, again = read_again()
    found = np.flatnonzero(repeated(position)).tolist()
    assert len(again) > 15
    assert set(found) <= set(again)
    assert len(found) >= len(again) - 2  # nothing before the first one, nothing where the arm turns


def test_what_rests_or_is_coarse_repeats_nothing() -> None:
    lot, time = np.random.default_rng(9), 0.002 * np.arange(3000)
    slow = np.sin(time)[:, np.newaxis] * np.array([1.0, 0.7])
    coarse = np.round(slow / 1e-3) * 1e-3
    resting = np.where(time[:, np.newaxis] < 2.0, slow[1000], slow)
    for position in (slow, coarse, resting, slow + 1e-5 * lot.standard_normal(slow.shape), slow[:3]):
        assert not repeated(position).any()
