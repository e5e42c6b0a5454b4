"""Parameters of findings: columns with noise of their own, and misfit that is not white."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy.deviations import blocks_of, deviations, instrumented
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray

ROW, PERIOD, PERIODS, JOINTS = 0.01, 10.0, 2, 2
ROWS = round(PERIOD * PERIODS / ROW)
FREE = np.array([[-np.inf, np.inf]])


def _examination(order: int = 0) -> Any:
    """White rows of two joints over two periods."""
    coefficients = tuple(np.full(order, 0.3) for _ in range(JOINTS))
    recording = SimpleNamespace(sample_time=0.5 * ROW)
    return SimpleNamespace(
        prepared=(SimpleNamespace(recording=recording, decimation=2, period=round(PERIOD / (0.5 * ROW))),),
        segment=np.zeros(ROWS, dtype=np.int64),
        used=np.ones((ROWS, JOINTS), dtype=np.bool_),
        whitening=Whitening("ar", coefficients, np.full(JOINTS, 7.0)),
        base=SimpleNamespace(independent=np.zeros(0)),
    )


def _repeated(values: FloatArray) -> FloatArray:
    """One period's rows of one joint, for all periods and joints."""
    return np.tile(values, PERIODS * JOINTS)


def test_noise_of_a_column_does_not_make_its_parameter_smaller() -> None:
    rng = np.random.default_rng(1)
    clean = rng.standard_normal(40_000)
    own, other = (clean + 0.7 * rng.standard_normal(clean.size) for _ in range(2))
    residual = 2.0 * clean + rng.standard_normal(clean.size)
    squares = float(own @ residual / (own @ own))
    found = instrumented(other[:, np.newaxis], own[:, np.newaxis], residual, FREE)
    assert squares < 1.4
    assert found == pytest.approx([2.0], abs=0.06)


def test_a_parameter_beyond_its_bounds_is_not_cut_off() -> None:
    column = np.ones((10, 1))
    assert instrumented(column, column, np.full(10, -1.0), np.array([[0.0, np.inf]])) is None


def test_white_rows_have_the_deviation_of_least_squares() -> None:
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((ROWS * JOINTS, 1))
    sigma = deviations(_examination(), columns, columns, rng.standard_normal(ROWS * JOINTS))
    assert sigma[0] == pytest.approx(1.0 / np.linalg.norm(columns), rel=0.35)
    assert sigma[0] >= 0.99 / np.linalg.norm(columns)


def test_misfit_that_repeats_in_every_period_and_joint_counts_once() -> None:
    """Blocks of half a second: 20 independent numbers, not 8000 rows, decide of the parameter."""
    rng = np.random.default_rng(3)
    blocks, rows = round(PERIOD / 0.5), round(0.5 / ROW)
    column = _repeated(np.repeat(rng.standard_normal(blocks), rows))[:, np.newaxis]
    spread, said = [], []
    for _ in range(300):
        misfit = _repeated(np.repeat(rng.standard_normal(blocks), rows))
        found = float(column[:, 0] @ misfit / (column[:, 0] @ column[:, 0]))
        spread.append(found)
        said.append(deviations(_examination(), column, column, misfit - found * column[:, 0])[0])
    assert np.sqrt(np.mean(np.square(said))) == pytest.approx(np.std(spread), rel=0.25)
    assert np.std(spread) > 10.0 / np.linalg.norm(column)


def test_a_column_that_is_not_there_has_no_deviation() -> None:
    rng = np.random.default_rng(4)
    columns = np.column_stack([rng.standard_normal(ROWS * JOINTS), np.zeros(ROWS * JOINTS)])
    sigma = deviations(_examination(), columns, columns, rng.standard_normal(ROWS * JOINTS))
    assert sigma[0] > 0.0
    assert sigma[1] == 0.0


def test_blocks_follow_the_rows_that_whitening_keeps() -> None:
    labels = blocks_of(_examination(order=3))
    assert labels.size == (ROWS - 3) * JOINTS
    assert labels.max() == round(PERIOD / 0.5) - 1
    first = labels[: ROWS - 3]
    period = round(PERIOD / ROW)
    assert (first[period:] == first[:-period]).all()
