"""Rows of hours: zeros take no memory, stacking copies nothing, and blocks give what the whole gives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robots
from ident import Recording, decimation, identify
from ident.effects import State
from ident.estimators.fit import stack, stack_columns
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from ident.preparation import observation, row_columns
from ident.preparation.row_memory import one_after_the_other, torques_of
from ident.statistics import triangle
from robots import Robot

SAMPLES = 200_000


def resident() -> int:
    """Bytes."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096


def test_columns_that_are_zero_take_no_memory() -> None:
    part = np.zeros((SAMPLES, 2, 16))
    part[:, 0, :2] = np.random.default_rng(1).standard_normal((SAMPLES, 2))
    before = resident()
    whole = one_after_the_other([part])
    assert whole.any(axis=2).all(axis=0).tolist() == [True, False]
    assert resident() - before < whole.nbytes / 4  # an eighth of it is not zero


def test_pieces_follow_one_another_and_are_given_up() -> None:
    lot = np.random.default_rng(2)
    pieces = [lot.standard_normal((count, 3, 4)) * lot.integers(0, 2, (3, 4)) for count in (5, 1, 7)]
    parts = list(pieces)
    whole = one_after_the_other(parts)
    assert not parts
    np.testing.assert_array_equal(whole, np.concatenate(pieces))
    beta = lot.standard_normal(4)
    np.testing.assert_allclose(torques_of(whole, beta), whole @ beta, atol=1e-14)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_rows_are_stacked_joint_by_joint(share: float) -> None:
    lot = np.random.default_rng(3)
    regressor = one_after_the_other([lot.standard_normal((50, 3, 4)) * lot.integers(0, 2, (3, 4))])
    used = lot.uniform(size=(50, 3)) >= share
    stacked = stack_columns(regressor, used)
    np.testing.assert_array_equal(stacked, regressor.transpose(1, 0, 2)[used.T])
    assert np.shares_memory(stacked, regressor) == used.all()


@pytest.mark.parametrize("samples", [3999, 4000, 4001, 12_345])
@pytest.mark.parametrize("factor", [2, 25])
def test_the_finite_filter_by_blocks_is_a_convolution(
    monkeypatch: pytest.MonkeyPatch, samples: int, factor: int
) -> None:
    monkeypatch.setattr(decimation, "_ROWS_AT_ONCE", 40)
    values = np.random.default_rng(4).standard_normal((samples, 2))
    reach = decimation.decimation_reach(factor, "fir")
    taps = decimation.windowed_sinc(reach, 0.8 / factor, decimation._FIR_BETA)
    held = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    whole = np.stack([np.convolve(column, taps, "valid") for column in held.T], axis=1)
    expected = whole[decimation.decimate_index(samples, factor)]
    np.testing.assert_allclose(decimation.decimate(values, factor, "fir"), expected, atol=1e-12)


def swung(robot: Robot) -> Recording:
    """Half a minute of an arm whose torque is that of its own description, with noise."""
    lot, time = np.random.default_rng(5), 0.002 * np.arange(15_000)
    tones = 2 * np.pi * lot.uniform(0.2, 1.5, (4, robot.n))
    phase = tones * time[:, np.newaxis, np.newaxis] + lot.uniform(0.0, 6.0, (4, robot.n))
    middle = 0.5 * (robot.lower + robot.upper)
    q, v, a = (
        0.1 * (tones**k * np.sin(phase + k * np.pi / 2)).sum(axis=1) + (middle if k == 0 else 0.0)
        for k in range(3)
    )
    model = RegressorModel.of(robot)
    torque = model.columns(State(q, v, a)) @ model.prior()
    torque += 0.01 * lot.standard_normal(torque.shape)
    return Recording("swung", time, None, q, robot.control_signal(torque))


def test_an_identification_by_blocks_is_that_in_one_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    """What bounds the memory of hours changes no digit that is printed."""
    robot = robots.load("tx40")
    changes = {"cutoff_hz": 15.0, "decimation": 8, "decimation_filter": "fir"}
    changes |= {"control_signal_lag": 0.0, "minimum_speed": 0.0}
    settings = robot.identification.model_copy(update=changes)
    robot = robot.model_copy(update={"identification": settings})
    recording = swung(robot)
    whole = identify(robot, (recording,)).result.least_squares
    monkeypatch.setattr(row_columns, "_LONG", 4000)
    monkeypatch.setattr(decimation, "_ROWS_AT_ONCE", 100)
    monkeypatch.setattr(triangle, "_ROWS", 500)
    blocks = identify(robot, (recording,)).result.least_squares
    by_chance = np.sqrt(np.diag(whole.covariance))
    assert np.abs(blocks.values - whole.values).max() < 1e-7 * by_chance.max()
    np.testing.assert_allclose(blocks.values, whole.values, rtol=1e-8, atol=1e-8 * by_chance.min())
    np.testing.assert_allclose(np.sqrt(np.diag(blocks.covariance)), by_chance, rtol=1e-6)
    observed = observation.observe(base_parameters(RegressorModel.of(robot)), (recording,), settings)
    assert np.shares_memory(stack(observed).x, observed.regressor)
