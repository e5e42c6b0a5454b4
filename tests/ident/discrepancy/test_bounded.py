"""Least squares within bounds, against scipy's where the data show every column."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from ident.discrepancy.bounded import within_bounds


@pytest.mark.parametrize("seed", range(40))
def test_it_is_the_optimum_where_every_column_is_seen(seed: int) -> None:
    generator = np.random.default_rng(seed)
    count = int(generator.integers(1, 7))
    columns = generator.standard_normal((60, count))
    residual = columns @ generator.standard_normal(count) + 0.3 * generator.standard_normal(60)
    free, ends = generator.random((2, count)) < 0.5, generator.random((2, count))
    bounds = np.where(free, np.inf, ends).T * [-1.0, 1.0]
    expected = lsq_linear(columns, residual, bounds.T, tol=1e-14).x
    assert within_bounds(columns, residual, bounds) == pytest.approx(expected, abs=1e-7)


def test_what_two_columns_make_together_is_shared_where_the_data_do_not_tell_them_apart() -> None:
    """scipy's answer here is 8·10⁷ and −8·10⁷."""
    generator = np.random.default_rng(0)
    one = generator.standard_normal(60)
    columns = np.stack([one, one + 1e-9 * generator.standard_normal(60)], axis=1)
    found = within_bounds(columns, one, np.array([[-np.inf, np.inf]] * 2))
    assert found == pytest.approx([0.5, 0.5], abs=1e-6)


def test_what_no_row_shows_is_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some machines' least squares leave a rounding error there, which is of any size once scaled."""
    columns = np.random.default_rng(0).standard_normal((60, 3))
    columns[:, 1] = 0.0
    solve = np.linalg.lstsq

    def rounded(*of: Any, **options: Any) -> Any:
        values, *rest = solve(*of, **options)
        return values - 1e-16, *rest

    monkeypatch.setattr(np.linalg, "lstsq", rounded)
    found = within_bounds(columns, columns @ [1.0, 1.0, 2.0], np.array([[-np.inf, np.inf]] * 3))
    assert found[1] == 0.0 and found == pytest.approx([1.0, 0.0, 2.0])
