"""The control signal between two samples, against a controller computed at every sample of its own."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

import robots
from ident.closed_loop.control_law import ControlLaw
from ident.preparation.observed_torque import with_mean_control_signal
from ident.preparation.set_points import set_points
from ident.recording import Recording
from robots import Robot

PERIOD, SECONDS = 0.004, 8.0


def arm(interpolation: str, kind: str = "cascade_p_pi") -> Robot:
    tx40 = robots.load("tx40")
    changes = {"interpolation": interpolation, "type": kind, "integral_gain": (0.0,) * tx40.n}
    return tx40.model_copy(update={"controller": tx40.controller.model_copy(update=changes)})


def motion(robot: Robot, time: np.ndarray) -> np.ndarray:
    """A smooth motion of the joints, samples × n."""
    waves = [np.sin(2 * np.pi * (1.0 + 0.7 * j) * time + j) for j in range(robot.n)]
    return np.array(robot.home) + 0.3 * np.stack(waves, axis=1)


def reference(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(0.0, SECONDS, PERIOD)
    return time, motion(robot, time)


def fine_course(robot: Robot, targets: np.ndarray) -> np.ndarray:
    """Control signals at every controller sample while the drives follow the motion smoothly and late."""
    per_sample = round(PERIOD / robot.controller.sample_time)
    points, speeds = set_points(robot, targets, PERIOD, per_sample)
    instants = np.arange(len(points)) * robot.controller.sample_time
    position = motion(robot, instants - 0.006) @ robot.transmission_matrix.T
    law = ControlLaw(robot.controller, position[0], np.zeros(robot.n))
    return np.array([law.step(*row) for row in zip(points, speeds, position, strict=True)])


def slow_part(values: np.ndarray, step: float) -> np.ndarray:
    """What lies below 20 Hz, by Fourier transform with a window over the whole record."""
    window = np.sin(np.pi * np.arange(len(values)) / len(values))[:, np.newaxis] ** 2
    spectrum = np.fft.rfft(values * window, axis=0)
    spectrum[np.fft.rfftfreq(len(values), step) > 20.0] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(values), axis=0))


@pytest.mark.parametrize("kind", ["cascade_p_pi", "pd"])
@pytest.mark.parametrize("interpolation", ["spline", "linear"])
def test_the_mean_is_that_of_all_controller_samples(interpolation: str, kind: Literal["pd"]) -> None:
    robot = arm(interpolation, kind)
    time, joints = reference(robot)
    targets = joints @ robot.transmission_matrix.T
    fine = fine_course(robot, targets)
    sampled = fine[::4]
    recording = Recording("run", time, joints, joints, sampled)
    corrected = with_mean_control_signal(robot, recording).control_signal
    truth = slow_part(fine, robot.controller.sample_time)[::4]
    before = np.abs(slow_part(sampled, PERIOD) - truth).max(axis=0)
    after = np.abs(slow_part(corrected, PERIOD) - truth).max(axis=0)
    assert np.all(after < 0.2 * before)


def test_what_is_at_the_limit_stays() -> None:
    robot = arm("spline")
    time, joints = reference(robot)
    limit = np.array(robot.controller.saturation)
    signal = np.tile(limit, (len(time), 1))
    signal[::2] *= 0.5
    corrected = with_mean_control_signal(robot, Recording("run", time, joints, joints, signal)).control_signal
    np.testing.assert_array_equal(corrected[1::2], signal[1::2])
    assert np.all(np.abs(corrected[::2] - signal[::2]).max(axis=0) > 0)


def test_nothing_to_add_without_references_or_where_the_controller_is_no_faster() -> None:
    robot = arm("spline")
    time, joints = reference(robot)
    without = Recording("run", time, None, joints, joints)
    assert with_mean_control_signal(robot, without) is without
    equal = Recording("run", time / 4, joints, joints, joints)
    assert with_mean_control_signal(robot, equal) is equal
