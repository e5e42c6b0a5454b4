"""A drive whose torque comes late: its signal is ahead of its torque, whatever moves the arm."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident import RegressorModel
from ident.effects import State
from ident.effects.family import Place
from ident.effects.vocabulary import form_of
from ident.parameters.present import Present

DELAY = 0.004
"""s."""


def test_the_torque_that_other_joints_ask_for_comes_late_too() -> None:
    """Where positions are read late the motion of the drive alone is old, and here it stands still."""
    robot = robots.load("tx40")
    time = np.arange(0.0, 1.0, 0.004)
    phase = 2 * np.pi * time
    position, velocity, acceleration = (np.zeros((time.size, 6)) for _ in range(3))
    position[:, 1], position[:, 2] = 0.3 * np.sin(phase), 0.4
    velocity[:, 1] = 2 * np.pi * 0.3 * np.cos(phase)
    acceleration[:, 1] = -((2 * np.pi) ** 2) * position[:, 1]
    model = RegressorModel.of(robot)
    present = Present(model, model.prior())
    place = Place("drive", (2,))
    state = State(position, velocity, acceleration, time)
    late = form_of(robot, "time_delay", ("ahead",)).effect(robot, place, (DELAY,), present)
    torque = present.torque(present.low_cutoff(state))[:, 2]
    inside = slice(20, -20)
    expected = np.interp(time + DELAY, time, torque) - torque
    shown = DELAY * late.columns(state)[:, :, 0]
    assert np.ptp(expected[inside]) > 0.05
    assert shown[inside, 2] == pytest.approx(expected[inside], abs=1e-3)
    assert np.abs(shown[:, [0, 1, 3, 4, 5]]).max() == 0.0
    (change,) = late.simulated(np.array([DELAY])).drives
    assert (change.drive, change.delay, change.position_age, change.signal_age) == (2, DELAY, 0.0, 0.0)
