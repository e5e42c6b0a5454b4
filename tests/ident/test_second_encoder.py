"""A second encoder shows a gear's stiffness without any model of the arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from ident import Recording
from ident.identification.second_encoder import words_of_second, wound

ROBOT = robots.load("emps")
TIME = np.arange(20_000) * 1e-3
STIFFNESS, INERTIA, ROTOR, FRICTION = 4e5, 90.0, 60.0, (200.0, 20.0)


def _recording(stiffness: float, late: float = 0.0) -> Recording:
    """An axis with friction that moves a mass; a spring between both encoders, read apart in time."""
    lot = np.random.default_rng(3)
    tones = [(0.02, 3.1, 0.3), (0.008, 9.7, 1.1), (0.002, 22.3, 2.0)]
    q = np.sum([a * np.sin(w * TIME + p) for a, w, p in tones], axis=0)
    v = np.gradient(q, TIME)
    gravity = 60.0 * np.sin(0.7 * TIME)  # a load that is not of the motion
    through = INERTIA * np.gradient(v, TIME) + gravity
    force = through + ROTOR * np.gradient(v, TIME) + FRICTION[0] * v + FRICTION[1] * np.sign(v)
    second = q - through / stiffness - late * v + 2e-7 * lot.standard_normal(q.size)
    position = q + 2e-7 * lot.standard_normal(q.size)
    signal = ROBOT.control_signal((force + 2.0 * lot.standard_normal(q.size))[:, np.newaxis])
    return Recording("log", TIME, None, position[:, np.newaxis], signal, second=second[:, np.newaxis])


@pytest.mark.parametrize("late", [0.0, 2e-4])
def test_the_stiffness_is_found_whatever_the_time_between_the_readings(late: float) -> None:
    (found,) = wound(ROBOT, _recording(STIFFNESS, late), 20.0)
    assert found.is_seen
    assert 1.0 / found.compliance == pytest.approx(STIFFNESS, rel=0.03)
    assert abs(found.compliance - 1.0 / STIFFNESS) < 4.0 * found.sigma
    (words,) = words_of_second(ROBOT, _recording(STIFFNESS, late), 20.0)
    assert "stiffness carriage 4" in words


def test_a_stiff_gear_is_not_said_to_wind() -> None:
    (words,) = words_of_second(ROBOT, _recording(1e11), 20.0)
    assert "see no gear wind" in words


def test_an_encoder_of_something_else_is_said() -> None:
    recording = _recording(STIFFNESS)
    assert recording.second is not None
    (words,) = words_of_second(ROBOT, replace(recording, second=0.5 * recording.second), 20.0)
    assert "move otherwise than the first ones" in words
    assert words_of_second(ROBOT, replace(recording, second=None), 20.0) == ()
