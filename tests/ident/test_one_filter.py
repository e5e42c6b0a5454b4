"""Both sides of the model see one filter and one hold, on clean multi-sine logs of a simulated arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from benchmarks.foreign_plant import ARMS, Settings, record
from benchmarks.foreign_plant.files import write_description
from ident import Options, Recording, RegressorModel, identify
from ident.closed_loop import simulate
from ident.closed_loop.integral_rule import _taken_in_first, integrates_first
from ident.signals import AlignedControlSignal
from robots import Robot
from tests.ident.closed_loop.test_centred import arm, driven, multi_sine

INERTIAS = ("ZZ1R", "ZZ2R", "ZZ3R", "Ia4", "Ia5", "Ia6")
HELD = 0.001


def clean() -> Recording:
    """Ten seconds with tones to 28 Hz, from steps of 12.5 µs, without noise."""
    run = driven(HELD, 80)
    return replace(multi_sine(HELD), position=run.position, control_signal=run.control_signal)


def inertias_off(**settings: object) -> float:
    """Largest relative error of what the tones show best, by least squares."""
    robot = arm(HELD)
    changed = robot.identification.model_copy(update=settings)
    robot = robot.model_copy(update={"identification": changed})
    fitted = identify(robot, (clean(),), options=Options(method="ls"))
    base = fitted.base
    truth = base.relation @ base.model.prior()
    places = [base.names.index(name) for name in INERTIAS if name in base.names]
    assert len(places) >= 4
    return float(np.abs(fitted.least_squares.beta[places] / truth[places] - 1.0).max())


def test_a_cut_off_within_the_motion_leaves_the_inertias_right() -> None:
    """Positions through a low-pass that the torque does not see: every inertia comes out too large."""
    assert inertias_off(cutoff_hz=25.0) < 0.003
    assert inertias_off(cutoff_hz=25.0, torque_filter="none") > 0.02


def test_what_is_held_acts_as_its_mean_over_the_hold() -> None:
    time = np.arange(0.0, 2.0, HELD)
    wave = np.sin(2 * np.pi * 28.0 * time)[:, np.newaxis]
    aligned = AlignedControlSignal(Recording("tone", time, None, np.zeros_like(wave), wave), HELD).at(
        HELD / 2
    )
    less = np.sinc(28.0 * HELD)
    assert less == pytest.approx(1 - 0.0013, abs=1e-4)
    inner = slice(20, -20)
    expected = less * np.sin(2 * np.pi * 28.0 * (time - HELD / 2))
    assert np.abs(aligned[inner, 0] - expected[inner]).max() < 2e-6


@pytest.fixture(scope="module")
def noisy(tmp_path_factory: pytest.TempPathFactory) -> tuple[Robot, Recording]:
    """A foreign arm in slow motion: noise moves it, and its encoders' noise moves the control signal."""
    plant, settings = ARMS["compact6"], Settings(periods=1, period=12.0)
    folder = tmp_path_factory.mktemp("arm")
    write_description(folder, plant, settings)
    log = record(plant, settings, (), 1, 0)
    recording = Recording("slow", log.time, log.reference, log.position, log.control_signal)
    return robots.load(folder / "robot.toml"), recording


def estimated(robot: Robot, recording: Recording) -> tuple[float, float]:
    signals = identify(robot, (recording,), options=Options(method="ls")).result.signals
    assert signals is not None and signals.estimated_lag is not None and signals.lag_sigma is not None
    return signals.estimated_lag, signals.lag_sigma


@pytest.mark.slow
def test_noise_in_the_loop_is_no_lag(noisy: tuple[Robot, Recording]) -> None:
    """The reference knows of no noise: along it the lag is found where measured motion has it wrong."""
    robot, recording = noisy
    lag, sigma = estimated(robot, recording)
    assert abs(lag - HELD / 2) < 3.0 * sigma
    own, own_sigma = estimated(robot, replace(recording, reference=None))
    assert own - HELD / 2 > 8.0 * own_sigma  # 2 ms of noise's own order in time
    assert sigma < 0.3 * (own - HELD / 2)


@pytest.mark.parametrize("first", [False, True])
def test_the_order_in_which_drives_integrate_is_read_off_the_recording(first: bool) -> None:
    """A described gain of 10 1/s at 1 kHz: taken in before the output it is 1 % of the velocity gain."""
    robot, recording = arm(HELD), multi_sine(HELD)
    drives = _taken_in_first(robot) if first else robot
    model = RegressorModel.of(drives)
    run = simulate(model, model.prior(), recording)
    recorded = replace(recording, position=run.position, control_signal=run.control_signal)
    assert integrates_first(robot, recorded) == first
    model = RegressorModel.of(robot)
    again = simulate(model, model.prior(), recorded)
    assert np.abs(again.position - run.position).max() < 1e-9
    no_integral = robot.controller.model_copy(update={"integral_gain": (0.0,) * 6})
    assert not integrates_first(robot.model_copy(update={"controller": no_integral}), recorded)
    wrong = tuple(1.05 * gain for gain in robot.controller.velocity_gain)
    changed = robot.controller.model_copy(update={"velocity_gain": wrong})
    assert not integrates_first(robot.model_copy(update={"controller": changed}), recorded)
