"""Noise of the other periods is no motion: columns made of it would be too long."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

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
