"""Filter, differences and decimation against what they are defined by."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robots
from ident.decimation import decimate, decimate_index, decimation_reach, decimation_stages
from ident.errors import IdentificationError
from ident.recording import Recording
from ident.signals import AlignedControlSignal, differentiate, kept_samples, low_pass


def test_low_pass_keeps_a_slow_sine_in_place_and_removes_a_fast_one() -> None:
    time = np.arange(4000) * 1e-3
    slow, fast = np.sin(2 * np.pi * 1.0 * time), np.sin(2 * np.pi * 200.0 * time)
    filtered = low_pass((slow + fast)[:, np.newaxis], 20.0, 1e-3, 4)[:, 0]
    assert np.abs(filtered - slow)[200:-200].max() < 1e-5


@pytest.mark.parametrize("cutoff", [0.0, -1.0, 500.0, 900.0])
def test_low_pass_refuses_a_cutoff_outside_the_band(cutoff: float) -> None:
    with pytest.raises(IdentificationError, match="below 500 Hz"):
        low_pass(np.zeros((100, 1)), cutoff, 1e-3, 4)


@pytest.mark.parametrize("accuracy", [2, 4, 6, 8])
def test_differences_are_exact_for_polynomials_of_their_order(accuracy: int) -> None:
    time = np.linspace(-1.0, 1.0, 81)
    values = np.column_stack([time**accuracy, time ** (accuracy - 1)])
    expected = np.column_stack([accuracy * time ** (accuracy - 1), (accuracy - 1) * time ** (accuracy - 2)])
    inner = slice(accuracy, -accuracy)
    found = differentiate(values, float(time[1] - time[0]), accuracy)
    assert np.abs(found - expected)[inner].max() < 1e-11


def test_higher_accuracy_loses_less_of_a_fast_motion() -> None:
    step = 0.004
    time = np.arange(1000) * step
    omega = 2 * np.pi * 8.0
    error = [
        np.abs(
            differentiate(np.sin(omega * time)[:, np.newaxis], step, k)[50:-50, 0] / omega
            - np.cos(omega * time)[50:-50]
        ).max()
        for k in (2, 4, 6, 8)
    ]
    assert error == sorted(error, reverse=True)
    assert error[-1] < 1e-5 < 1e-3 < error[0]


@given(st.integers(min_value=1, max_value=1000))
def test_stages_multiply_to_the_factor(factor: int) -> None:
    stages = decimation_stages(factor)
    assert int(np.prod(stages, dtype=np.int64)) == factor
    assert all(stage > 1 for stage in stages)


@given(st.integers(min_value=3000, max_value=5000), st.sampled_from([1, 2, 5, 7, 10, 20, 26, 100]))
def test_decimated_values_belong_to_the_decimated_index(samples: int, factor: int) -> None:
    slow = np.cos(2 * np.pi * np.arange(samples) / 2000.0)
    thin = decimate(slow[:, np.newaxis], factor)[:, 0]
    index = decimate_index(samples, factor)
    assert thin.shape == index.shape
    assert index[-1] == samples - 1
    assert np.all(np.diff(index) == factor)
    # A Chebyshev filter's gain lies between 1 and its ripple: 0.05 dB, both ways, once a stage.
    ripple = 1 - 10 ** (-2 * 0.05 / 20 * len(decimation_stages(factor)))
    inner = slice(index.size // 4, -(index.size // 4))
    assert np.abs(thin - slow[index])[inner].max() < ripple + 1e-6


@given(st.integers(min_value=2, max_value=60), st.integers(min_value=0, max_value=1999))
def test_the_finite_filter_spreads_an_error_no_farther_than_its_reach(factor: int, at: int) -> None:
    values = np.zeros((2000, 1))
    values[at] = 1.0
    thin = decimate(values, factor, "fir")[:, 0]
    index = decimate_index(2000, factor)
    assert thin.shape == index.shape
    reach = decimation_reach(factor, "fir")
    touched = index[np.abs(thin) > 1e-15]
    assert np.all(np.abs(touched - at) <= reach)
    # MATLAB's filter rings on, which is why it has no reach to speak of.
    assert decimation_reach(factor, "chebyshev") == 0


@pytest.mark.parametrize("factor", [1, 5, 17])
def test_the_finite_filter_keeps_what_is_slow_and_removes_what_would_fold(factor: int) -> None:
    time = np.arange(4000) * 1e-3
    row_rate = 1000.0 / factor
    slow = np.sin(2 * np.pi * 0.05 * row_rate * time)[:, np.newaxis]
    fast = np.sin(2 * np.pi * 0.95 * row_rate * time)[:, np.newaxis]
    inner = slice(10, -10)
    kept = decimate(slow, factor, "fir")[inner, 0]
    assert np.abs(kept - slow[decimate_index(4000, factor)][inner, 0]).max() < 2e-3
    if factor > 1:
        assert np.abs(decimate(fast, factor, "fir")[inner]).max() < 1e-3


@pytest.mark.parametrize(("samples", "decimation"), [(100, 20), (240, 100), (60, 1)])
def test_a_record_too_short_for_its_filters_is_refused(samples: int, decimation: int) -> None:
    settings = robots.load("tx40").identification.model_copy(update={"decimation": decimation})
    with pytest.raises(IdentificationError, match="too short a record; allowed: at least"):
        kept_samples(samples, settings)


def test_matlab_phase_keeps_the_last_sample() -> None:
    # decimate(x, 10) of 24792 samples keeps 2480, the last of them sample 24792.
    index = decimate_index(24792, 10)
    assert index.size == 2480
    assert index[-1] == 24791
    assert index[0] == 1


def test_alignment_shifts_the_control_signal_by_its_lag() -> None:
    time = np.arange(500) * 0.004
    signal = np.sin(2 * np.pi * 2.0 * time)[:, np.newaxis]
    recording = Recording("sine", time, None, np.zeros_like(signal), signal)
    aligned = AlignedControlSignal(recording).at(0.0005)
    assert np.abs(aligned[5:-5, 0] - np.sin(2 * np.pi * 2.0 * (time[5:-5] - 0.0005))).max() < 1e-6
    assert AlignedControlSignal(recording).at(0.0) is signal
