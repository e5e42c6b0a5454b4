"""Single wrong samples are named and set aside; what an arm does is left alone."""

from __future__ import annotations

import numpy as np
import pytest

from ident import IdentificationError
from ident.preparation.outliers import without_outliers
from robots.arrays import FloatArray

TIME = np.arange(5000) * 1e-3
POSITION = np.column_stack([0.1 * np.sin(2 * np.pi * TIME), 0.2 * np.sin(5 * TIME)])
STEP = np.array([2e-3, 2e-3])


def mended(values: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    return without_outliers("log", "position", TIME, values, STEP)


def test_one_sample_is_named_with_its_time_and_set_aside() -> None:
    values = POSITION.copy()
    values[1234, 1] += 0.02
    found, sentences = mended(values)
    assert sentences == ("log: position of joint 2 is off by up to 0.02 at one sample (1.234 s), set aside",)
    assert np.abs(found - POSITION).max() < 1e-9


def test_noise_reversals_and_a_clean_record_are_left_alone() -> None:
    noisy = POSITION + 1e-4 * np.random.default_rng(1).standard_normal(POSITION.shape)
    corner = np.column_stack([np.abs(TIME - 2.5), np.abs(TIME - 1.0)])
    for values in (POSITION, noisy, corner):
        found, sentences = mended(values)
        assert sentences == ()
        assert found is values or np.array_equal(found, values)


@pytest.mark.parametrize("wrong", [range(100, 4900, 300), (700, 703)], ids=["many", "side by side"])
def test_more_than_single_samples_are_refused(wrong: range | tuple[int, ...]) -> None:
    values = POSITION.copy()
    values[list(wrong), 0] += 0.05
    with pytest.raises(IdentificationError, match="position of joint 1 jumps at"):
        mended(values)
