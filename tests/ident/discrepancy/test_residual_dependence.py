"""What a residual depends on, and what does not repeat and should not be there."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ident.discrepancy.binned_residual import binned_residuals
from ident.discrepancy.residual_dependence import residual_dependences
from ident.discrepancy.unrepeated import _bursts, _nearly_white, _shocks, _single_frequency
from ident.effects import State
from ident.statistics.correlation_ratio import correlation_ratio


def test_the_correlation_ratio_is_the_share_that_a_quantity_explains() -> None:
    generator = np.random.default_rng(0)
    quantity = generator.uniform(-1, 1, 20_000)
    noise = generator.normal(size=quantity.size)
    shape = np.sin(7 * quantity)
    values = shape / shape.std() + noise
    assert correlation_ratio(quantity, values) == pytest.approx(0.5, abs=0.03)
    assert correlation_ratio(generator.permutation(quantity), values) < 0.01


def test_a_constant_quantity_explains_nothing() -> None:
    assert correlation_ratio(np.ones(100), np.random.default_rng(0).normal(size=100)) == 0.0


def coloured(seed: int, samples: int = 3000) -> np.ndarray:
    generator = np.random.default_rng(seed)
    series = np.zeros(samples)
    for k in range(1, samples):
        series[k] = 0.8 * series[k - 1] + generator.normal()
    return series


@pytest.mark.parametrize("seed", range(8))
def test_coloured_noise_alone_is_no_vibration(seed: int) -> None:
    white = _nearly_white(coloured(seed))
    assert not _single_frequency(0, white, 0.004)
    assert not _bursts(0, white, 0.004)


def test_a_vibration_is_found_at_its_frequency() -> None:
    time = 0.004 * np.arange(3000)
    found = _single_frequency(2, _nearly_white(coloured(1) + 2 * np.sin(2 * np.pi * 17.3 * time)), 0.004)
    assert len(found) == 1
    assert found[0].joint == 2
    assert "17." in found[0].sentence


def test_bursts_are_found() -> None:
    series = coloured(2)
    series[1000:1150] *= 6
    assert _bursts(0, _nearly_white(series), 0.004)[0].kind == "bursts"


@pytest.mark.parametrize("seed", range(6))
def test_noise_alone_has_no_shocks(seed: int) -> None:
    assert not _shocks(0, _nearly_white(coloured(seed)))


def test_a_few_sudden_torques_are_shocks_though_they_hardly_raise_the_noise() -> None:
    series = coloured(3)
    series[200::350] += 14.0
    found = _shocks(1, _nearly_white(series))
    assert found[0].kind == "shocks"
    assert found[0].joint == 1
    assert found[0].p_value < 1e-6


def test_a_block_that_repeats_exactly_is_no_quiet_between_bursts() -> None:
    white = np.random.default_rng(5).normal(size=4000)
    white[1000:1600] = 0.0
    assert not _bursts(0, white, 0.004)


def test_a_joint_that_stands_still_has_no_residual_to_live_anywhere() -> None:
    generator = np.random.default_rng(7)
    motion = generator.normal(size=(400, 2))
    motion[:, 1] = 0.0
    piece: Any = SimpleNamespace(
        moving=np.column_stack([np.ones(400, dtype=np.bool_), np.zeros(400, dtype=np.bool_)]),
        measured=State(motion, motion, motion),
        time=0.008 * np.arange(400),
        thin=lambda columns: columns,
        torque=motion,
    )
    residual = generator.normal(size=(400, 2))
    still = residual_dependences([piece], [residual], [motion])[1]
    assert still.rms == 0.0 and all(share == 0.0 for _, share in still.shares)
    assert still.sentence() == "joint 2: no row in which it moves"
    drawn = binned_residuals([piece], [residual], [residual], [motion])
    assert [one.centre.size > 0 for one in drawn] == [True] * 4 + [False] * 4
