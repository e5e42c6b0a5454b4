"""Percentiles and distinct values are those of NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from ident.ordered import distinct, median, percentile, quantiles

LOT = np.random.default_rng(3)


@pytest.mark.parametrize("count", [1, 2, 3, 100, 101])
def test_percentiles(count: int) -> None:
    values = LOT.standard_normal((count, 2))
    for share in (0.0, 33.0, 90.0, 99.0, 100.0):
        np.testing.assert_allclose(
            percentile(values, share), np.percentile(values, share, axis=0), atol=1e-15
        )
    shares = np.linspace(0.0, 1.0, 7)
    np.testing.assert_allclose(quantiles(values[:, 0], shares), np.quantile(values[:, 0], shares), atol=1e-15)
    assert median(values) == pytest.approx(np.median(values), abs=1e-15)


def test_distinct_values() -> None:
    for values in (LOT.integers(0, 9, 50), LOT.integers(0, 9, (5, 4)) / 4.0, np.empty(0), np.ones(3)):
        np.testing.assert_array_equal(distinct(values), np.unique(values))


def test_what_is_no_number_has_no_percentile() -> None:
    values = np.array([[1.0, 2.0], [np.nan, 3.0], [0.0, 1.0]])
    np.testing.assert_array_equal(percentile(values, 50.0), [np.nan, 2.0])
    assert np.isnan(median(values)) and np.isnan(quantiles(values[:, 0], np.array([0.0, 1.0]))).all()
