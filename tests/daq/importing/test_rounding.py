"""Positions with too few digits are said to be rounded; an encoder's steps and noisy positions are not."""

from __future__ import annotations

import numpy as np
import pytest

from daq.importing.rounding import digits_of, rounded
from robots.arrays import FloatArray

NOISE = np.random.default_rng(5).standard_normal((5000, 2))
MOTION = 0.4 * np.sin(np.multiply.outer(0.004 * np.arange(5000), (1.3, 2.1)))


@pytest.mark.parametrize(
    ("digits", "noise", "said"), [(4, 1e-6, True), (3, 1e-4, True), (4, 1e-4, False), (6, 1e-6, False)]
)
def test_rounding_is_said_where_it_is_most_of_the_noise(digits: int, noise: float, said: bool) -> None:
    words = rounded("log.csv", ("q1", "q2"), np.round(MOTION + noise * NOISE, digits))
    assert bool(words) == said
    if said:
        assert f"q1 and 1 more written with {digits} digits" in words[0]


@pytest.mark.parametrize("step", [2 * np.pi / 2**16, 2 * np.pi / 4096 / 101, 1.0])
def test_steps_of_an_encoder_are_no_rounding(step: float) -> None:
    counts = np.rint((MOTION + 1e-6 * NOISE) / (2 * np.pi / 2**16))
    assert rounded("log.csv", ("q1", "q2"), counts * step) == ()


def test_digits_of_large_and_of_standing_values() -> None:
    values: FloatArray = np.array([12345.25, 3.5, 0.125])
    assert digits_of(values) == 3
    assert rounded("log.csv", ("q1",), np.full((100, 1), 0.5)) == ()
