"""Repeats of a trajectory: found from the reference, and what differs between them is noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ident.discrepancy.repeats import mean_period, not_repeating, others_mean, repeat_length


def wave(period: int, periods: int, joints: int = 2) -> np.ndarray:
    phase = 2 * np.pi * np.arange(period) / period
    one = np.column_stack([np.sin(phase + j) + 0.3 * np.sin(3 * phase) for j in range(joints)])
    return np.tile(one, (periods, 1))


@given(period=st.integers(300, 900), periods=st.integers(2, 4))
def test_the_period_of_a_reference_is_found(period: int, periods: int) -> None:
    assert repeat_length(wave(period, periods), 0.004) == period


def test_a_last_period_may_be_cut_short() -> None:
    assert repeat_length(wave(500, 3)[:1300], 0.004) == 500


@pytest.mark.parametrize(
    "reference", [None, np.zeros((2000, 2)), np.random.default_rng(0).normal(size=(2000, 2))]
)
def test_what_does_not_repeat_has_no_period(reference: np.ndarray | None) -> None:
    assert repeat_length(reference, 0.004) is None


def test_nearly_the_same_is_not_the_same() -> None:
    reference = wave(500, 2)
    reference[700, 1] += 1e-3
    assert repeat_length(reference, 0.004) is None


def test_the_mean_of_the_others_leaves_a_sample_out() -> None:
    values = np.repeat([[1.0], [2.0], [6.0]], 4, axis=0)
    assert others_mean(values, 4)[:, 0] == pytest.approx(np.repeat([4.0, 3.5, 1.5], 4))


def test_the_mean_period_has_a_last_one_that_is_not_whole() -> None:
    values = np.array([[1.0, 2.0, 3.0, 3.0, 4.0, 5.0, 8.0]]).T
    assert mean_period(values, 3)[:, 0] == pytest.approx([4.0, 3.0, 4.0, 4.0, 3.0, 4.0, 4.0])


@given(periods=st.integers(2, 5), seed=st.integers(0, 20))
def test_what_does_not_repeat_keeps_the_variance_of_one_period(periods: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    noise = generator.normal(size=(400 * periods, 3))
    rest = not_repeating(wave(400, periods, 3) + noise, 400)
    assert rest.std() == pytest.approx(1.0, abs=0.06)


def test_what_repeats_is_no_noise() -> None:
    assert np.abs(not_repeating(wave(400, 3), 400)).max() < 1e-12
