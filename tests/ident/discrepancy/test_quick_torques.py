"""What the filter of the positions does to torques that are quicker than the position loop."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from benchmarks.naming_parameters import compared
from drivers.simulated import draw_truth
from ident import RegressorModel
from ident.effects import State
from ident.effects.shown import as_filter_shows, as_positions_show
from ident.effects.vocabulary import family_named
from ident.parameters.present import Present
from ident.signals import low_pass

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


@pytest.mark.parametrize(("name", "shape"), [("gear_ripple", (2.0, 1e6)), ("torque_ripple", (2.0, 0.0))])
@pytest.mark.parametrize(("times", "left"), [(0.2, 1.0), (1.0, 0.5), (4.0, 0.0)])
def test_ripples_know_what_the_filter_leaves(
    name: str, shape: tuple[float, ...], times: float, left: float
) -> None:
    """At a steady speed; four times the cut-off is beyond what the samples can show."""
    family, model = family_named(name), RegressorModel.of(TX40)
    place = family.places(TX40)[2]
    settings = TX40.identification.model_copy(update={"cutoff_hz": 1e9})
    wide = TX40.model_copy(update={"identification": settings})
    shown, whole = (
        family.effect(robot, place, shape, Present(model, model.prior())) for robot in (TX40, wide)
    )
    state = _state(0.004)
    assert state.time is not None
    speed = times * 2 * np.pi * CUTOFF / (2.0 * TX40.drive[2].gear)
    position, velocity = state.position.copy(), state.velocity.copy()
    position[:, 2], velocity[:, 2] = speed * state.time, speed
    moving = State(position, velocity, state.acceleration, state.time)
    share = np.linalg.norm(shown.columns(moving)) / np.linalg.norm(whole.columns(moving))
    assert share == pytest.approx(left, abs=0.01)


@pytest.mark.parametrize("step", [1e-4, 4e-3])
@pytest.mark.parametrize("frequency", [5.0, 30.0, 50.0, 60.0, 90.0])
def test_the_share_is_that_of_the_filter(frequency: float, step: float) -> None:
    """Against the filter itself: at 250 Hz it lets 0.89 of 50 Hz pass, at 10 kHz 0.81."""
    settings = TX40.identification
    time = np.arange(0.0, 4.0, step)
    wave = np.sin(2 * np.pi * frequency * time)[:, np.newaxis]
    edge = round(1.0 / step)
    kept = low_pass(wave, settings.cutoff_hz, step, settings.filter_order)[edge:-edge]
    share = float(as_filter_shows(TX40, np.array([frequency]), time)[0])
    assert share == pytest.approx(float(np.sqrt(2.0) * kept.std()), abs=0.01)
    left = {5.0: 1.0, 30.0: 0.996, 60.0: 0.5, 90.0: 0.037}
    if frequency in left and step == 1e-4:
        assert share == pytest.approx(left[frequency], abs=0.01)
    if frequency == 50.0:
        assert share == pytest.approx(0.887 if step > 1e-3 else 0.811, abs=0.005)
        assert float(as_filter_shows(TX40, np.array([frequency]), None)[0]) == pytest.approx(0.811, abs=0.005)


def test_nothing_is_left_beyond_half_the_sampling_rate() -> None:
    time = np.arange(0.0, 1.0, 0.004)
    assert as_filter_shows(TX40, np.array([124.9, 125.0, 125.1, 250.0]), time) == pytest.approx(
        0.0, abs=0.004
    )


def test_a_lag_in_steps_is_half_a_step_shorter() -> None:
    """The plant's current at the end of a step acts all through the step."""
    robot = robots.load("tx40")
    scenario = {"current_loop_lag": [{"drive": 3, "time_constant": 0.003}]}
    found = {"lag3": (0.003, 1e-5)}
    pairs = compared(robot, draw_truth(robot, 7), scenario, "current_loop_lag", [3], found)
    assert pairs["lag"][2] == pytest.approx(0.003 - 0.5 * 0.00025, abs=3e-6)
