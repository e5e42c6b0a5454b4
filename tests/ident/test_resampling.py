"""Samples that are not evenly spaced: brought to a grid, cut at long gaps, or refused with the place."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident import IdentificationError
from ident.preparation.resampling import Uniform, clock_of, longest_gap, uniform_recording

PERIOD, CUTOFF = 0.002, 20.0
EVEN = np.arange(2000) * PERIOD


def course(time: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(2 * np.pi * 1.5 * time), np.cos(2 * np.pi * 2.5 * time)], axis=1)


def call(time: np.ndarray, taken: np.ndarray | None = None, reference: bool = True) -> Uniform:
    """Of samples with the stamps ``time`` that were taken at ``taken``."""
    values = course(time if taken is None else taken)
    return uniform_recording("log", time, values if reference else None, values, 2.0 * values, CUTOFF)


def test_even_samples_pass_as_they_are() -> None:
    even = call(EVEN)
    assert even.words == ()
    assert even.there.all()
    assert even.recording.time is EVEN
    np.testing.assert_array_equal(even.recording.position, course(EVEN))


@given(st.integers(0, 1000), st.floats(0.05, 0.5))
def test_jitter_is_taken_out(seed: int, share: float) -> None:
    time = EVEN + share * PERIOD * np.random.default_rng(seed).uniform(-1, 1, EVEN.size)
    even = call(time)
    assert even.there.all()
    assert np.ptp(np.diff(even.recording.time)) < 1e-12
    assert np.diff(even.recording.time)[0] == pytest.approx(PERIOD, rel=1e-3)
    assert np.abs(even.recording.position - course(even.recording.time)).max() < 1e-5
    assert np.abs(even.recording.control_signal - 2 * course(even.recording.time)).max() < 2e-5
    assert even.recording.reference is not None
    assert "off an even clock" in even.words[0] and even.words[0].startswith("log: ")


@pytest.mark.parametrize("share", [0.1, 0.5, 1.4])
@pytest.mark.parametrize("seed", [1, 2])
def test_samples_that_were_only_stamped_late_keep_their_clock(seed: int, share: float) -> None:
    stamps = EVEN + share * PERIOD * np.random.default_rng(seed).uniform(-1, 1, EVEN.size)
    even = call(stamps, EVEN)
    assert "time stamps are up to" in even.words[0]
    assert even.recording.position == pytest.approx(course(EVEN), abs=1e-12)
    assert even.recording.sample_time == pytest.approx(PERIOD, rel=1e-3)


def test_missing_samples_are_filled_and_counted() -> None:
    keep = np.random.default_rng(0).random(EVEN.size) > 0.05
    keep[[0, -1]] = True
    even = call(EVEN[keep], reference=False)
    assert even.recording.time == pytest.approx(EVEN)
    assert even.recording.reference is None
    assert even.there.all()
    assert np.abs(even.recording.position - course(EVEN)).max() < 1e-4
    assert f"{np.count_nonzero(~keep)} of 2000 samples are missing, 2 in a row" in even.words[0]
    assert "resampled every 2 ms" in even.words[1] and "% at 20 Hz" in even.words[1]


def test_missing_samples_are_found_behind_stamps_that_jitter() -> None:
    noise = np.random.default_rng(5)
    keep = noise.random(EVEN.size) > 0.02
    keep[[0, -1]] = True
    stamps = EVEN[keep] + 0.3 * PERIOD * noise.uniform(-1, 1, np.count_nonzero(keep))
    even = call(stamps, EVEN[keep])
    assert f"{np.count_nonzero(~keep)} of 2000 samples are missing" in even.words[0]
    assert even.recording.position == pytest.approx(course(EVEN), abs=1e-4)


def test_a_long_gap_is_cut_and_said() -> None:
    gap = int(longest_gap(CUTOFF) / PERIOD) + 1
    even = call(np.delete(EVEN, np.arange(900, 900 + gap)))
    assert np.flatnonzero(~even.there).tolist() == list(range(900, 900 + gap))
    assert f"{gap} in a row after 1.798 s" in even.words[0]
    assert "cut at 1 gap longer than" in even.words[1]
    assert max(map(len, even.words)) <= 160


def test_a_gap_that_a_spline_can_fill_costs_what_is_said() -> None:
    # The worst case of the bound: a sine at the motion's bandwidth, half of its period inside the gap.
    frequency = 0.2 * CUTOFF
    gap = int(longest_gap(CUTOFF) / PERIOD) - 1
    worst = 0.0
    for begin in range(900, 1030, 5):
        kept = np.delete(EVEN, np.arange(begin, begin + gap))
        values = np.sin(2 * np.pi * frequency * kept)[:, np.newaxis]
        even = uniform_recording("log", kept, None, values, values, CUTOFF)
        assert even.there.all()
        truth = np.sin(2 * np.pi * frequency * even.recording.time)
        worst = max(worst, float(np.abs(even.recording.position[:, 0] - truth).max()))
    assert 0.001 < worst < 0.01


def test_coarse_stamps_count_as_the_even_clock_that_they_are() -> None:
    even = call(np.floor(EVEN / 0.005) * 0.005, EVEN)
    assert even.there.all()
    assert np.diff(even.recording.time)[0] == pytest.approx(PERIOD, rel=2e-3)


@pytest.mark.parametrize(
    ("time", "said"),
    [
        (np.concatenate([EVEN[:1000], EVEN[:1000]]), r"does not increase after 1\.998 s.*cut the log there"),
        (np.where(np.arange(2000) == 1000, EVEN - 2.5 * PERIOD, EVEN), r"does not increase after 1\.998 s"),
        (np.zeros(2000), r"does not increase after 0 s"),
        (EVEN[:2], "too few"),
    ],
)
def test_time_that_goes_back_is_refused_with_the_place(time: np.ndarray, said: str) -> None:
    with pytest.raises(IdentificationError, match=said) as caught:
        call(time)
    assert "\n" not in str(caught.value)


def test_gaps_of_stamps_that_the_samples_do_not_have_are_none() -> None:
    """A source of 34 ms read every 33 ms, less what was read twice: stamps have gaps, the samples none."""
    samples = 700
    taken = 0.034 * np.arange(samples)
    ticks = np.ceil(taken / 0.033)  # the first reading of each sample
    stamps = 0.033 * ticks
    assert np.ptp(np.diff(ticks)) == 1.0
    position = np.stack([np.sin(2.0 * taken), np.cos(3.1 * taken)], axis=1)
    clock = clock_of("log", stamps, position)
    assert not clock.stamped
    assert clock.period == pytest.approx(0.034, rel=1e-3)
    assert np.ptp(clock.taken - taken) < 1e-3
    there = clock_of("log", stamps, np.stack([np.sin(2.0 * stamps), np.cos(3.1 * stamps)], axis=1))
    assert there.period == pytest.approx(0.033, rel=1e-3)
    assert np.ptp(there.taken - stamps) < 1e-6
