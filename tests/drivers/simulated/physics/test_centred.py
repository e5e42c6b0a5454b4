"""The simulated arm is the arm of steps 20 times finer: it answers no fraction of a step early."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation
from scipy.signal import butter, sosfiltfilt

import robots
from drivers.simulated import PlantTruth, bench, nominal_truth, simulate_offline
from drivers.simulated.plant import STEP_RATE
from robots import Robot

SECONDS, PERIOD = 4.0, 0.001


def quiet(robot: Robot) -> PlantTruth:
    truth = nominal_truth(robot)
    still = (0.0,) * robot.n
    return replace(truth, encoder_noise=still, torque_noise=still)


def finely_read() -> Robot:
    """The shipped arm with encoders whose counts a controller does not feel."""
    robot = robots.load("tx40")
    drives = tuple(d.model_copy(update={"encoder_counts": 1000 * d.encoder_counts}) for d in robot.drive)
    return robot.model_copy(update={"drive": drives})


def multi_sine(robot: Robot) -> np.ndarray:
    generator = np.random.default_rng(5)
    time = np.arange(0.0, SECONDS, PERIOD)[:, np.newaxis]
    fade = np.clip(np.minimum(time, SECONDS - time) / 0.5, 0.0, 1.0)
    fade = fade**3 * (10 - 15 * fade + 6 * fade**2)
    waves = np.zeros((time.shape[0], robot.n))
    for hz, size in [(0.4, 0.4), *((hz, 0.25 / (2 * np.pi * hz) ** 1.5) for hz in range(3, 29, 5))]:
        waves += size * np.sin(2 * np.pi * hz * time + generator.uniform(0, 2 * np.pi, robot.n))
    return np.array(robot.home) + fade * waves


def smooth(values: np.ndarray) -> np.ndarray:
    return np.asarray(sosfiltfilt(butter(4, 60.0, fs=1.0 / PERIOD, output="sos"), values, axis=0))


def test_the_arm_answers_when_one_of_steps_20_times_finer_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """Away from reversals, where bristles bend within a few steps."""
    robot = finely_read()
    truth, reference = quiet(robot), multi_sine(robot)
    usual = simulate_offline(robot, truth, reference, cycle_time=PERIOD)
    monkeypatch.setattr(bench, "STEP_RATE", 20 * STEP_RATE)
    fine = simulate_offline(robot, truth, reference, cycle_time=PERIOD)
    transmission = robot.transmission_matrix
    slow = np.abs(fine.true_velocity @ transmission.T) < 0.02 * (np.abs(transmission) @ robot.velocity_limits)
    moving = ~binary_dilation(slow, np.ones((161, 1)))
    apart = smooth(usual.control_signal - fine.control_signal) * moving
    rate = smooth(np.gradient(fine.control_signal, PERIOD, axis=0)) * moving
    late = -np.sum(apart * rate, axis=0) / np.sum(rate**2, axis=0)
    share = np.sqrt(np.sum(apart**2, axis=0) / np.sum(smooth(fine.control_signal) ** 2 * moving, axis=0))
    assert moving.mean(axis=0).min() > 0.3
    assert np.abs(late).max() < 2e-6  # half a step is 125e-6
    assert share.max() < 3e-4
