"""Samples that are not evenly spaced: mended, or refused with the place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident import IdentificationError
from ident.preparation.resampling import uniform_recording

PERIOD = 0.002


def course(time: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(2 * np.pi * 3.0 * time), np.cos(2 * np.pi * 5.0 * time)], axis=1)


def call(time: np.ndarray, reference: bool = True):
    values = course(time)
    return uniform_recording("log", time, values if reference else None, values, 2.0 * values)


def test_even_samples_pass_as_they_are() -> None:
    time = np.arange(500) * PERIOD
    recording, words = call(time)
    assert words == ()
    assert recording.time is time
    np.testing.assert_array_equal(recording.position, course(time))


@given(st.integers(0, 1000), st.floats(0.02, 0.2))
def test_jitter_is_taken_out(seed: int, share: float) -> None:
    even = np.arange(1000) * PERIOD
    time = even + share * PERIOD * np.random.default_rng(seed).uniform(-1, 1, even.size)
    time[[0, -1]] = even[[0, -1]]
    recording, words = call(time)
    assert recording.time == pytest.approx(even, abs=1e-12)
    assert np.abs(recording.position - course(even)).max() < 3e-5
    assert np.abs(recording.control_signal - 2 * course(even)).max() < 6e-5
    assert recording.reference is not None
    assert "not uniform" in words[0] and words[0].startswith("log: ")


def test_a_few_missing_samples_are_filled_and_named() -> None:
    even = np.arange(2000) * PERIOD
    time = np.delete(even, [700, 701, 702, 1500])
    recording, words = call(time, reference=False)
    assert recording.time == pytest.approx(even)
    assert recording.reference is None
    assert np.abs(recording.position - course(even)).max() < 3e-5
    assert "4 samples are missing, 3 in a row after 1.398 s" in words[0]


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (
            lambda t: np.delete(t, np.arange(900, 920)),
            r"20 of 2000 samples are missing, 20 in a row after 1.798 s",
        ),
        (lambda t: np.delete(t, np.arange(100, 1900, 50)), r"36 of 2000 samples are missing"),
        (
            lambda t: np.where(np.arange(t.size) == 1000, t - 2.5 * PERIOD, t),
            r"does not increase after 1.998 s",
        ),
        (
            lambda t: np.concatenate([t[:1000], t[1000:] + 0.0]) + 0.7 * PERIOD * (np.arange(t.size) == 600),
            r"0\.6 ms before 1\.202 s, median 2 ms",
        ),
        (lambda t: t[:2], "too few"),
    ],
)
def test_worse_is_refused_in_one_line_with_the_place(damage, said: str) -> None:
    with pytest.raises(IdentificationError, match=said) as caught:
        call(damage(np.arange(2000) * PERIOD))
    assert "\n" not in str(caught.value)
