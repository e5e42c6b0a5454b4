"""What comes and goes over a recording is no noise; noise is not taken for what comes and goes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from ident.discrepancy.by_evidence.evidence import slow as module
from ident.discrepancy.by_evidence.evidence.noise import autoregressive
from ident.discrepancy.by_evidence.evidence.slow import without_slow
from ident.discrepancy.repeats import not_repeating
from ident.effects import State
from robots.arrays import FloatArray

RATE, PERIOD, PERIODS, NOISE, DRAG = 125.0, 1250, 3, 0.01, 0.4
"""Hz; rows; N·m."""

TIME = np.arange(PERIOD * PERIODS) / RATE
SPEED = np.sin(2.0 * np.pi * 0.4 * TIME) + 0.6 * np.sin(2.0 * np.pi * 0.7 * TIME + 1.0)
"""Both repeat every ten seconds."""


def motion() -> State:
    column = SPEED[:, np.newaxis]
    return State(column, column, column, TIME)


def not_slow(torque: FloatArray) -> FloatArray:
    """(rows,) what is left of a torque (rows,)."""
    used = np.abs(SPEED[:, np.newaxis]) > 0.1
    left = not_repeating(torque[:, np.newaxis], PERIOD)
    return without_slow(motion(), used, left, PERIOD)[:, 0]


def marginal(noise: FloatArray) -> float:
    return autoregressive(noise, np.zeros(noise.size, dtype=np.int64), np.abs(SPEED) > 0.1).marginal


def white() -> FloatArray:
    return NOISE * np.random.default_rng(0).normal(size=TIME.size)


def test_a_brake_that_rubs_now_and_then_is_no_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every seven seconds, which is no part of the motion's period."""
    drag = DRAG * np.sign(SPEED) * (0.5 + 0.5 * np.sin(2.0 * np.pi * TIME / 7.0))
    noise = white()
    found = marginal(not_slow(drag + noise))
    monkeypatch.setattr(module, "_ROWS", TIME.size)  # six half waves and no more
    before = marginal(not_slow(drag + noise))
    assert before > 8.0 * NOISE
    assert found < 1.2 * NOISE


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_noise_loses_no_more_than_what_is_slow(monkeypatch: pytest.MonkeyPatch, memory: float) -> None:
    """White, or with a memory of ten rows."""
    noise = np.asarray(lfilter([1.0], [1.0, -memory], white()))
    left = not_slow(noise)
    monkeypatch.setattr(module, "_ROWS", TIME.size)
    assert left == pytest.approx(not_slow(noise))


def test_noise_that_moves_the_arm_is_not_taken_for_friction_that_changes() -> None:
    """It stands in the speed and in what does not repeat, and two periods see the same of many half waves.

    Those come to a constant where the motion rests at the ends of its period, and no row is there.
    """
    time = TIME[: 2 * PERIOD]
    rests = np.clip(np.minimum(time % 10.0, 10.0 - time % 10.0) - 1.0, 0.0, 1.0)
    speed = (rests * SPEED[: time.size])[:, np.newaxis]
    noise = np.asarray(lfilter([1.0], [1.0, -0.67], white()[: time.size]))[:, np.newaxis]
    moved = np.asarray(lfilter([0.02 / NOISE], [1.0, -0.8], noise, axis=0))
    used, left = np.abs(speed) > 0.1, not_repeating(noise, PERIOD)
    found = without_slow(State(speed, speed + moved, speed, time), used, left, PERIOD)
    assert found[used].std() == pytest.approx(noise.std(), rel=0.05)


def test_a_fit_has_ten_rows_of_each_column(monkeypatch: pytest.MonkeyPatch) -> None:
    """However likely more half waves are: so many columns would take noise."""
    asked: list[tuple[int, FloatArray]] = []
    less = module._less

    def noted(*given: Any) -> FloatArray:
        asked.append((given[-1], less(*given)))
        return asked[-1][1]

    def innovation(noise: FloatArray, used: object) -> float:
        return next(0.5**waves for waves, left in asked if left is noise)

    monkeypatch.setattr(module, "_less", noted)
    monkeypatch.setattr(module, "_innovation", innovation)
    not_slow(white())
    rows, most = int(np.count_nonzero(np.abs(SPEED) > 0.1)), asked[-1][0]
    assert [waves for waves, _ in asked] == [6 * 2**k for k in range(len(asked))]
    assert 3 * most * 10 <= rows < 3 * 2 * most * 10
