"""Filters, differences and decimation sample by sample: against scipy's own and worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, cheby1, filtfilt, firwin, sosfiltfilt

import robots
from ident.decimation import decimate, decimate_index, decimation_reach, decimation_stages
from ident.errors import IdentificationError
from ident.recording import Recording
from ident.signals import (
    AlignedControlSignal,
    differentiate,
    kept_samples,
    low_pass,
    low_pass_where_sampled,
    motion,
)
from robots.arrays import FloatArray


def noise(samples: int, channels: int = 2, seed: int = 3) -> FloatArray:
    return np.random.default_rng(seed).normal(size=(samples, channels)).cumsum(axis=0)


def test_the_low_pass_is_scipys_with_three_orders_of_padding() -> None:
    values = noise(200)
    expected = filtfilt(*butter(4, 20.0 / 500.0), values, axis=0, padlen=12)
    # Both round in the direct form, whose poles lie close to each other.
    assert low_pass(values, 20.0, 1e-3, 4) == pytest.approx(expected, abs=1e-10)
    assert low_pass(values[:13], 20.0, 1e-3, 4).shape == (13, 2)
    with pytest.raises(IdentificationError, match=r"^12 samples; allowed: more than 12 to be filtered"):
        low_pass(values[:12], 20.0, 1e-3, 4)


def test_what_is_sampled_too_slowly_passes_as_it_is() -> None:
    values, time = noise(40), np.arange(40) * 0.01
    filtered = low_pass_where_sampled(values, time, 49.0, 4)
    assert filtered == pytest.approx(low_pass(values, 49.0, 0.01, 4))
    assert low_pass_where_sampled(values, time, 50.0, 4) is values  # half the sampling rate
    assert low_pass_where_sampled(values, None, 20.0, 4) is values
    few = values[:12]
    assert low_pass_where_sampled(few, time[:12], 20.0, 4) is few
    assert low_pass_where_sampled(values[:13], time[:13], 20.0, 4) is not None
    assert np.abs(low_pass_where_sampled(values[:13], time[:13], 20.0, 4) - values[:13]).max() > 1e-6


@pytest.mark.parametrize("accuracy", [4, 6, 8])
def test_edges_and_short_records_have_first_differences(accuracy: int) -> None:
    reach, values = accuracy // 2, noise(30)
    found, plain = differentiate(values, 0.1, accuracy), np.gradient(values, 0.1, axis=0)
    edges = np.r_[0:reach, 30 - reach : 30]
    assert found[edges] == pytest.approx(plain[edges], rel=1e-12)
    assert np.all(np.abs(found - plain)[reach : 30 - reach] > 1e-9)
    short = values[: 2 * reach]
    assert differentiate(short, 0.1, accuracy) == pytest.approx(np.gradient(short, 0.1, axis=0))
    one = differentiate(values[: 2 * reach + 1], 0.1, accuracy)
    assert np.flatnonzero(
        np.abs(one - np.gradient(values[: 2 * reach + 1], 0.1, axis=0)).max(axis=1) > 1e-9
    ) == [reach]


def test_weights_of_the_differences_are_those_of_fornberg() -> None:
    impulse = np.zeros((21, 1))
    impulse[10] = 1.0
    for accuracy, weights in (
        (2, [0.5]),
        (4, [2 / 3, -1 / 12]),
        (6, [3 / 4, -3 / 20, 1 / 60]),
        (8, [4 / 5, -1 / 5, 4 / 105, -1 / 280]),
    ):
        found = differentiate(impulse, 1.0, accuracy)[:, 0]
        reach = len(weights)
        assert found[10 - reach : 10] == pytest.approx(weights[::-1], rel=1e-12)
        assert found[11 : 11 + reach] == pytest.approx([-w for w in weights], rel=1e-12)


def test_motion_is_filtered_differenced_and_trimmed_in_that_order() -> None:
    settings = robots.load("tx40").identification.model_copy(
        update={"cutoff_hz": 15.0, "trim_samples": (30, 20), "decimation": 2, "derivative_accuracy": 4}
    )
    time, position = 5.0 + np.arange(300) * 0.004, noise(300)
    found = motion(time, position, settings)
    q = low_pass(position, 15.0, 0.004, settings.filter_order)
    velocity = differentiate(q, 0.004, 4)
    assert found.time == pytest.approx(time[30:280])
    assert found.position == pytest.approx(q[30:280], rel=1e-9)
    assert found.velocity == pytest.approx(velocity[30:280], rel=1e-9)
    assert found.acceleration == pytest.approx(differentiate(velocity, 0.004, 4)[30:280], rel=1e-8)


@pytest.mark.parametrize(
    ("decimation", "fewest"), [(1, 48), (3, 48), (5, 50), (20, 480), (100, 1000), (17, 170)]
)
def test_the_fewest_samples_that_are_worth_it(decimation: int, fewest: int) -> None:
    """Ten rows, and twice the padding of 24 at the last of the stages (20 = 10·2, 100 = 10·10, 17 whole)."""
    changes = {"decimation": decimation, "trim_samples": (7, 5)}
    settings = robots.load("tx40").identification.model_copy(update=changes)
    assert kept_samples(fewest + 12, settings) == slice(7, fewest + 7)
    with pytest.raises(IdentificationError, match=rf"at least {fewest + 12} with trim 7 \+ 5 and"):
        kept_samples(fewest + 11, settings)


@pytest.mark.parametrize(
    ("factor", "stages"),
    [
        (1, []),
        (2, [2]),
        (13, [13]),
        (14, [7, 2]),
        (17, [17]),
        (26, [13, 2]),
        (100, [10, 10]),
        (169, [13, 13]),
    ],
)
def test_stages_are_at_most_13_and_the_largest_comes_first(factor: int, stages: list[int]) -> None:
    assert decimation_stages(factor) == stages


@pytest.mark.parametrize(("samples", "factor"), [(101, 5), (100, 5), (103, 13), (700, 26)])
def test_decimation_is_matlabs(samples: int, factor: int) -> None:
    """Chebyshev I of order 8, 0.05 dB, both ways, 24 samples of padding; the last sample is kept."""
    values = expected = direct = noise(samples)
    for stage in decimation_stages(factor):
        design = (8, 0.05, 0.8 / stage)
        smooth = sosfiltfilt(cheby1(*design, output="sos"), expected, axis=0, padlen=24)
        expected = smooth[(len(smooth) - 1) % stage :: stage]
        smooth = filtfilt(*cheby1(*design), direct, axis=0, padlen=24)
        direct = smooth[(len(smooth) - 1) % stage :: stage]
    # Of the direct form, which MATLAB's is too. Which of two direct forms rounds worse depends on the
    # processor (fused products or not): ten times, where another order or ripple is off by 10⁻³ and more.
    rounding = 10.0 * float(np.abs(direct - expected).max())
    assert rounding < 1e-4
    assert decimate(values, factor) == pytest.approx(expected, abs=rounding)
    assert decimate(values.T, factor, axis=1) == pytest.approx(expected.T, abs=rounding)
    index = decimate_index(samples, factor)
    assert index.size == -(-samples // factor) and index[-1] == samples - 1
    assert decimate(values, 1) is values


@pytest.mark.parametrize("factor", [2, 5])
def test_the_finite_filter_is_a_kaiser_window_that_holds_the_ends(factor: int) -> None:
    values = noise(60)
    taps = firwin(8 * factor + 1, 0.8 / factor, window=("kaiser", 6.0))
    held = np.pad(values, ((4 * factor, 4 * factor), (0, 0)), mode="edge")
    smooth = np.column_stack([np.convolve(column, taps, "valid") for column in held.T])
    expected = smooth[decimate_index(60, factor)]
    assert decimate(values, factor, "fir") == pytest.approx(expected, abs=1e-10)
    assert decimate(values.T, factor, "fir", axis=1) == pytest.approx(expected.T, abs=1e-10)
    assert decimation_reach(factor, "fir") == 4 * factor
    assert decimation_reach(1, "fir") == 0
    assert decimate(values, 1, "fir") is values


def recorded(signal: FloatArray) -> Recording:
    time = 2.0 + np.arange(len(signal)) * 0.01
    return Recording("r", time, None, np.zeros_like(signal), signal)


def test_a_held_signal_is_its_mean_about_the_instant_that_acts() -> None:
    """The mean of t² over a hold h about c is c² + h²/12; before the first sample nothing is known."""
    time = 2.0 + np.arange(100) * 0.01
    recording = recorded((time**2)[:, np.newaxis])
    found = AlignedControlSignal(recording, hold=0.02).at(0.005)[:, 0]
    centre = np.clip(time - 0.005, 2.01, 2.98)
    assert found == pytest.approx(centre**2 + 0.02**2 / 12, rel=1e-9)
    late = AlignedControlSignal(recording, hold=0.02).at(-0.005)[:, 0]
    assert late[-1] == pytest.approx(2.98**2 + 0.02**2 / 12, rel=1e-9)


def test_a_lag_without_a_hold_shifts_and_stays_inside_the_record() -> None:
    time = 2.0 + np.arange(100) * 0.01
    recording = recorded((time**3)[:, np.newaxis])
    found = AlignedControlSignal(recording).at(0.015)[:, 0]
    assert found == pytest.approx(np.maximum(time - 0.015, 2.0) ** 3, rel=1e-9)
    assert AlignedControlSignal(recording, hold=0.02).at(0.0) is recording.control_signal
