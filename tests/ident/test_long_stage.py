"""A long record is decimated at the samples that are kept, and sees no more of it than the rows want."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cheby1, sosfiltfilt

import robots
from ident import Recording
from ident.decimation import decimate
from ident.long_stage import LongStage
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from ident.preparation import row_columns
from ident.preparation.observation import observed_columns
from ident.signals import low_pass

SETTINGS = {"cutoff_hz": 50.0, "decimation": 50, "decimation_filter": "chebyshev", "derivative_accuracy": 2}


def smoothed(series: np.ndarray, factor: int) -> np.ndarray:
    """By SciPy, at every sample, channels × samples."""
    return np.asarray(sosfiltfilt(cheby1(8, 0.05, 0.8 / factor, output="sos"), series, axis=1, padlen=24))


@pytest.mark.parametrize("samples", [20_000, 20_003])
@pytest.mark.parametrize("factor", [2, 5, 10, 13])
def test_rows_are_those_of_the_filter_at_every_sample(factor: int, samples: int) -> None:
    walk = np.random.default_rng(factor).standard_normal((2, samples)).cumsum(axis=1)
    assert LongStage.of(samples, factor) is not None
    whole = smoothed(walk, factor)
    expected = whole[:, (samples - 1) % factor :: factor]  # the last sample is kept
    np.testing.assert_allclose(decimate(walk, factor, axis=1), expected, atol=3e-9 * np.abs(walk).max())


def test_a_short_record_has_no_long_stage() -> None:
    assert LongStage.of(1000, 10) is None


@pytest.mark.parametrize("step", [2, 5])
def test_one_sample_of_several_is_enough_of_what_is_slow(step: int) -> None:
    noise = np.random.default_rng(1).standard_normal((30_007, 2))
    slow = low_pass(noise, 50.0, 0.0002, 4)
    some = LongStage.of(len(slow), 10, step)
    assert some is not None
    seen = some.seen
    assert seen.size < len(slow) / step + 4 * some.near * 10
    expected = decimate(slow.T, 10, axis=1)
    np.testing.assert_allclose(some.rows(slow.T[:, seen]), expected, atol=1e-7 * np.abs(slow).max())
    quick = decimate(noise.T, 10, axis=1)
    assert np.abs(some.rows(noise.T[:, seen]) - quick).max() > 0.1 * np.abs(quick).max()


def test_how_many_samples_are_enough() -> None:
    robot = robots.load("tx40").identification.model_copy(update=SETTINGS)
    assert row_columns.sufficient_step(robot, 0.0002) == 5
    assert row_columns.sufficient_step(robot.model_copy(update={"cutoff_hz": 400.0}), 0.0002) == 2
    others = {"cutoff_hz": 2000.0}, {"decimation_filter": "fir"}, {"filter_order": 1}
    for other in others:
        assert row_columns.sufficient_step(robot.model_copy(update=other), 0.0002) == 1


def test_the_columns_of_an_arm_are_those_at_every_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise of positions and friction that jumps included; only what has no jump is thinned."""
    robot = robots.load("tx40")
    settings = robot.identification.model_copy(update=SETTINGS)
    lot, time = np.random.default_rng(2), 0.0002 * np.arange(20_011)
    swing = np.sin(2 * np.pi * lot.uniform(0.2, 1.5, robot.n) * time[:, np.newaxis])
    position = 0.5 * (robot.lower + robot.upper) + 0.3 * swing + 1e-5 * lot.standard_normal(swing.shape)
    recording = Recording("swing", time, None, position, np.zeros_like(position))
    base = base_parameters(RegressorModel.of(robot))
    thinned = observed_columns(base, recording, settings)
    monkeypatch.setattr(row_columns, "sufficient_step", lambda *_: 1)
    whole = observed_columns(base, recording, settings)
    assert not np.array_equal(thinned, whole)
    size = np.sqrt(np.mean(whole**2, axis=0))
    assert np.abs(thinned - whole).max() < 1e-5 * size.max()
    rest = np.sqrt(np.mean((thinned - whole) ** 2, axis=0))
    assert np.all(rest <= 1e-6 * size + 1e-12 * size.max())
