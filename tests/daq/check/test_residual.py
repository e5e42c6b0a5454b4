"""A step of the residual that came before there were enough nights to tell it."""

from __future__ import annotations

import numpy as np
import pytest

from daq.check.residual import ENOUGH, LEARNING, SPREAD, residual_increase_of
from robots.arrays import FloatArray


def drawn(nights: int, seed: int, spread: float = 0.05) -> FloatArray:
    """(nights, 6) residual torques."""
    rng = np.random.default_rng(seed)
    return np.array([5, 6, 3.5, 1.2, 1.9, 0.9]) * 0.01 * np.exp(rng.normal(0.0, spread, (nights, 6)))


def first_told(nights: FloatArray, start: int) -> tuple[int, tuple[int, ...]] | None:
    """Night on which it is told and its joints; nights on which nothing was told teach."""
    taught = list(range(start))
    for k in range(start, len(nights)):
        found = residual_increase_of(nights[taught], tuple(nights[k]))
        if found:
            return k, tuple(joint for joint, _ in found)
        taught.append(k)
    return None


@pytest.mark.parametrize("start", [1, 2, 3, 4])
def test_a_step_within_the_first_nights_is_told_once_there_are_enough_after_it(start: int) -> None:
    """75 % more on one joint, where two nights may differ by as much: the nights since say that it stays."""
    for seed in range(10):
        nights = drawn(20, seed, spread=0.03)
        nights[start:, 1] *= 1.75
        told = first_told(nights, start)
        assert told is not None and told[1] == (2,), (seed, told)
        assert start + ENOUGH - 1 <= told[0] <= start + 7, (seed, told)


def test_one_odd_baseline_among_nights_that_differ_as_much_is_no_step() -> None:
    """Of 200 arms whose nights differ by the prior's deviation, at most as many as were promised."""
    told = [first_told(drawn(LEARNING, seed, SPREAD), 1) for seed in range(200)]
    assert sum(one is not None for one in told) <= 4  # steps, and single nights beyond 1.3 times the largest


def test_a_step_that_has_gone_again_is_told_no_more() -> None:
    """However sure it is that the nights in between were different."""
    nights = drawn(26, 3, spread=0.02)
    nights[2:25, 1] *= 2.2
    assert residual_increase_of(nights[:24], tuple(nights[24]))
    assert not residual_increase_of(nights[:25], tuple(nights[25]))


def test_small_steps_and_those_of_an_arm_that_is_known_are_left_to_the_other_rule() -> None:
    nights = drawn(40, 4, spread=0.01)
    nights[3:, 1] *= 1.25
    assert first_told(nights, 3) is None
    nights[3:, 1] *= 1.8 / 1.25
    assert not residual_increase_of(nights[:LEARNING], tuple(nights[LEARNING]))


def test_a_residual_that_creeps_is_told_beside_the_first_nights() -> None:
    """By 0.6 % a night it is never 1.3 times the largest before, and doubles in four months."""
    nights = drawn(180, 5, spread=0.03)
    nights[40:, 4] *= np.exp(0.006 * np.arange(140))
    told = first_told(nights, 1)
    assert told is not None and told[1] == (5,) and 95 <= told[0] <= 125, told


def test_seasons_are_no_creep() -> None:
    """18 K between the first nights and the coldest, at 1.6 % a kelvin (the largest of six arms)."""
    nights = drawn(366, 6, spread=0.045) * np.exp(-0.016 * 9.0 * np.cos(np.arange(366) / 58.1))[:, None]
    assert first_told(nights, 1) is None
