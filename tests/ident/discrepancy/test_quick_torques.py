"""What the filter of the positions does to torques that are quicker than the position loop."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from benchmarks.naming_parameters import compared
from drivers.simulated import draw_truth
from ident.discrepancy.library import effect_rows
from robots.arrays import FloatArray

STEP, CUTOFF = 0.004, 60.0
TIME = np.arange(0.0, 8.0, STEP)


def _amplitude(name: str, frequency: float) -> float:
    """Of a wave of one that an effect makes, as it enters the rows (undecimated)."""

    def columns(state: FloatArray) -> FloatArray:
        return np.sin(2 * np.pi * frequency * state)[:, np.newaxis, np.newaxis]

    scene: Any = SimpleNamespace(
        settings=SimpleNamespace(cutoff_hz=CUTOFF, filter_order=4),
        recording=SimpleNamespace(sample_time=STEP),
        instruments=TIME,
        thin=lambda values: values,
    )
    effect: Any = SimpleNamespace(name=name, columns=columns)
    rows = effect_rows(scene, effect, shown=True)[200:-200, 0, 0]
    return float(np.sqrt(2.0) * rows.std())


@pytest.mark.parametrize("name", ["gear_ripple", "torque_ripple"])
def test_a_ripple_shows_as_much_as_the_filter_leaves(name: str) -> None:
    assert _amplitude(name, 5.0) == pytest.approx(1.0, abs=0.01)
    assert _amplitude(name, CUTOFF) == pytest.approx(0.5, abs=0.02)  # forward and backward


def test_slow_effects_are_not_filtered() -> None:
    assert _amplitude("viscous_friction", CUTOFF) == pytest.approx(1.0, abs=0.02)


def test_a_lag_in_steps_is_half_a_step_shorter() -> None:
    """The plant's current at the end of a step acts all through the step."""
    robot = robots.load("tx40")
    scenario = {"current_loop_lag": [{"drive": 3, "time_constant": 0.003}]}
    found = {"lag3": (0.003, 1e-5)}
    pairs = compared(robot, draw_truth(robot, 7), scenario, "current_loop_lag", [3], found)
    assert pairs["lag"][2] == pytest.approx(0.003 - 0.5 * 0.00025, abs=3e-6)
