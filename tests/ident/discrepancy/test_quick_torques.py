"""What the filter of the positions does to torques that are quicker than the position loop."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from benchmarks.naming_parameters import compared
from drivers.simulated import draw_truth
from ident import RegressorModel
from ident.discrepancy.present import Present
from ident.effects import State
from ident.effects.placed import as_positions_show
from ident.effects.vocabulary import family_named

TX40 = robots.load("tx40")
CUTOFF = TX40.identification.cutoff_hz


def _state(step: float) -> State:
    time = np.arange(0.0, 8.0, step)
    still = np.zeros((time.size, 6))
    return State(still, still, still, time)


def _amplitude(frequency: float, step: float) -> float:
    """Of a wave of one that a quick effect makes, as it enters the rows."""
    state = _state(step)
    assert state.time is not None
    wave = np.zeros((state.time.size, 6, 2))
    wave[:, 3, 1] = np.sin(2 * np.pi * frequency * state.time)
    shown = as_positions_show(TX40, state, wave)
    assert not shown[:, :3].any() and not shown[:, 3, 0].any()
    return float(np.sqrt(2.0) * shown[200:-200, 3, 1].std())


def test_a_quick_torque_shows_as_much_as_the_filter_leaves() -> None:
    assert _amplitude(5.0, 0.004) == pytest.approx(1.0, abs=0.01)
    assert _amplitude(CUTOFF, 0.004) == pytest.approx(0.5, abs=0.02)  # forward and backward


def test_samples_too_far_apart_for_the_filter_had_none() -> None:
    assert _amplitude(40.0, 0.01) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("name", ["gear_ripple", "torque_ripple"])
def test_ripples_go_through_the_filter(name: str) -> None:
    """At a steady speed at which the waves come at the cut-off."""
    family, model = family_named(name), RegressorModel.of(TX40)
    place = family.places(TX40)[2]
    shape = (2.0, *(0.0 for _ in family.shapes(TX40, place)[1:]))
    effect = family.effect(TX40, place, shape, Present(model, model.prior()))
    state = _state(0.004)
    assert state.time is not None
    speed = 2 * np.pi * CUTOFF / (2.0 * TX40.drive[2].gear)
    position, velocity = state.position.copy(), state.velocity.copy()
    position[:, 2], velocity[:, 2] = speed * state.time, speed
    moving = State(position, velocity, state.acceleration, state.time)
    shown = effect.columns(moving)[200:-200, 2]
    bare = effect.columns(State(position, velocity, state.acceleration))[200:-200, 2]
    share = np.linalg.norm(shown - shown.mean(axis=0)) / np.linalg.norm(bare - bare.mean(axis=0))
    assert share == pytest.approx(0.5, abs=0.03)


def test_a_lag_in_steps_is_half_a_step_shorter() -> None:
    """The plant's current at the end of a step acts all through the step."""
    robot = robots.load("tx40")
    scenario = {"current_loop_lag": [{"drive": 3, "time_constant": 0.003}]}
    found = {"lag3": (0.003, 1e-5)}
    pairs = compared(robot, draw_truth(robot, 7), scenario, "current_loop_lag", [3], found)
    assert pairs["lag"][2] == pytest.approx(0.003 - 0.5 * 0.00025, abs=3e-6)
