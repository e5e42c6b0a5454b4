"""Noise of the other periods is no motion: columns made of it would be too long."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from ident.discrepancy.by_evidence.evidence import expected_motion as expected_motion_module
from ident.discrepancy.by_evidence.evidence.expected_motion import expected_motion
from ident.discrepancy.repeats import others_mean
from ident.effects import State

RATE, PERIOD, CUTOFF = 500.0, 2000, 50.0


def motions(high_hz: float) -> tuple[State, State, np.ndarray]:
    """Own and other periods' motion of one joint: a tone of 1 Hz, a higher one and noise; and the truth."""
    time = np.arange(3 * PERIOD) / RATE
    tones = ((1.0, 1.0), (high_hz, 0.3))
    clean = sum(size * np.sin(2 * np.pi * hz * time) for hz, size in tones)
    noise = 0.3 * np.random.default_rng(3).normal(size=time.size)
    noise = sosfiltfilt(butter(4, CUTOFF, fs=RATE, output="sos"), noise)
    acceleration = (clean + noise)[:, np.newaxis]
    own = State(np.zeros_like(acceleration), np.zeros_like(acceleration), acceleration, time)
    return own, State(own.position, own.velocity, others_mean(acceleration, PERIOD), time), clean


def rate_error(high_hz: float, expected: bool) -> float:
    """Error of the acceleration's rate over the rate."""
    own, other, clean = motions(high_hz)
    if expected:
        used = np.ones(own.acceleration.shape, dtype=np.bool_)
        other = expected_motion(own, other, used, CUTOFF, 1.0 / RATE, PERIOD)
    found, truth = np.gradient(other.acceleration[:, 0]), np.gradient(clean)
    return float(np.std(found - truth) / np.std(truth))


def test_a_rate_of_the_other_periods_is_motion_and_no_noise() -> None:
    assert rate_error(2.0, expected=False) > 2.0
    assert rate_error(2.0, expected=True) < 0.5


def test_a_tone_near_the_cut_off_stays() -> None:
    """A filter with a lower cut-off takes it away: of a multi-sine a lag would come out a third too large."""
    own, other, _ = motions(40.0)
    used = np.ones(own.acceleration.shape, dtype=np.bool_)
    found = expected_motion(own, other, used, CUTOFF, 1.0 / RATE, PERIOD).acceleration[:, 0]
    tone = np.exp(2j * np.pi * 40.0 * np.asarray(own.time))
    assert 2 * abs(np.mean(found * tone)) > 0.27


def test_half_an_octave_beyond_a_cut_off_a_seventeenth_of_a_tone_is_left() -> None:
    """A low-pass of order 4 that goes both ways has |H|² = 1 / (1 + 2⁴) there."""
    time = np.arange(4 * PERIOD) / RATE
    tone = np.sin(2 * np.pi * 20.0 * np.sqrt(2.0) * time)[:, np.newaxis]
    _, low = expected_motion_module._bands(tone, [20.0], 1.0 / RATE, PERIOD)
    assert np.std(low) / np.std(tone) == pytest.approx(1.0 / 17.0, rel=0.05)


def test_below_a_sixteenth_of_the_cut_off_all_is_motion() -> None:
    """Whatever another period has there stays: friction that warms differs from period to period."""
    time = np.arange(3 * PERIOD) / RATE
    motion, slow = (np.sin(2 * np.pi * hz * time)[:, np.newaxis] for hz in (1.0, 0.25))
    noise = 0.05 * np.random.default_rng(0).normal(size=motion.shape)
    own = State(motion, motion, motion + noise, time)
    other = State(motion, motion, motion + 0.2 * slow, time)
    used = np.ones(motion.shape, dtype=np.bool_)
    found = expected_motion(own, other, used, CUTOFF, 1.0 / RATE, PERIOD).acceleration
    assert found[:, 0] @ slow[:, 0] > 0.8 * 0.2 * (slow[:, 0] @ slow[:, 0])
