"""Least squares of the triangle of the rows, block by block, and of the errors of a part of a long record."""

from __future__ import annotations

import numpy as np
import pytest

from ident.statistics import restricted, triangle
from ident.statistics.restricted import of_the_errors, regression_whitening
from ident.statistics.triangle import triangle_beside, triangle_of
from robots.arrays import FloatArray


def tall(seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    lot = np.random.default_rng(seed)
    x = lot.standard_normal((301, 5)) * np.array([1.0, 1e3, 1e-3, 1.0, 7.0])
    return x, lot.standard_normal(301), lot.uniform(0.1, 3.0, 301)


@pytest.mark.parametrize("rows", [7, 100, 301, 1000])
def test_blocks_make_the_triangle_of_the_whole(monkeypatch: pytest.MonkeyPatch, rows: int) -> None:
    monkeypatch.setattr(triangle, "_ROWS", rows)
    x, y, weights = tall(1)
    r = triangle_of(x)
    np.testing.assert_allclose(r.T @ r, x.T @ x, rtol=1e-9, atol=1e-9)
    r, shares = triangle_beside(x, y * weights, weights)
    expected = np.linalg.lstsq(x * weights[:, np.newaxis], y * weights, rcond=None)[0]
    np.testing.assert_allclose(np.linalg.solve(r, shares), expected, rtol=1e-8)
    r, shares = triangle_beside(x, y)
    np.testing.assert_allclose(np.linalg.solve(r, shares), np.linalg.lstsq(x, y, rcond=None)[0], rtol=1e-8)


def test_the_errors_of_hours_are_those_of_recordings_spread_over_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of twelve recordings four; the process of the errors comes out as that of all."""
    lot = np.random.default_rng(3)
    segment, used = np.repeat(np.arange(12), 500), np.ones((6000, 1), dtype=np.bool_)
    errors = lot.standard_normal(6000)
    for k in range(1, 6000):
        errors[k] += 0.6 * errors[k - 1]
    x = lot.standard_normal((6000, 1, 3))
    y = x @ np.array([1.0, 2.0, 3.0]) + errors[:, np.newaxis]
    whole = regression_whitening(y, x, segment, used)
    monkeypatch.setattr(restricted, "_MOST_SAMPLES", 2000)
    names = np.unique(of_the_errors(y, x, segment, used)[2])
    assert names.tolist() == [0, 4, 7, 11]
    part = regression_whitening(y, x, segment, used)
    assert part.coefficients[0][0] == pytest.approx(whole.coefficients[0][0], abs=0.06)
    assert part.sigma[0] == pytest.approx(whole.sigma[0], rel=0.05)
    assert part.coefficients[0][0] != whole.coefficients[0][0]
