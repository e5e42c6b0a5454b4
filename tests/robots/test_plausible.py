"""Figures of a robot.toml that no arm has, and windows that none may have, are refused."""

from __future__ import annotations

import re

import pytest

import robots
from robots import RobotFileError
from robots.windows import LARGEST_WINDOW, following_error_window
from tests.robots.conftest import RobotFolder


@pytest.mark.parametrize(
    ("old", "new", "key", "problem"),
    [
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, -1e308]", "gravity[3]", "-1e+308 is too small"),
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, -0.981]", "gravity", "has length 0.981 m/s²"),
        ("gain = 9.05", "gain = 1e-320", "drive[4].gain", "is too small"),
        ("gain = 9.05", "gain = 90.5", "drive[4].gain", "is 460.7 N·m; the joints' torque limits ask"),
        ("gear = 48.0", f"gear = {57 * 48.0}", "drive[4].gear", "makes a motor speed of 1.87e+05 min⁻¹"),
        ("velocity = 7.155", "velocity = 0.0001", "joint[4].velocity", "is too small"),
        ("acceleration = 20.0", "acceleration = 2000.0", "joint[1].jerk", "limit of joint_1 in 500 s"),
        ("torque_noise = 0.058", "torque_noise = 580", "joint[1].torque_noise", "is above the torque limit"),
        ("per_count = 0.0005", "per_count = 0.5", "drive[1].control_signal.per_count", "makes 7.48 counts"),
        ("coulomb = 2.41", "coulomb = 241", "drive[4].dynamics.coulomb", "more than the drive can overcome"),
        ("viscous = 1.11", "viscous = 111", "drive[4].dynamics.viscous", "takes 794.2 N·m"),
        ("inertia = 0.0341", "inertia = 34.1", "drive[4].dynamics.inertia", "takes 682 N·m"),
        ("position_gain = [40.0,", "position_gain = [0.4,", "controller.position_gain[1]", "be 3.52 rad"),
        ("encoder_counts = 65536\ngear = 4", "encoder_counts = 1\ngear = 4", "drive[3].encoder_counts", "17"),
    ],
)  # fmt: skip
def test_figures_that_no_arm_has(folder: RobotFolder, old: str, new: str, key: str, problem: str) -> None:
    """Each within what TOML and floating point can hold; the issue's own three among them."""
    folder.edit(folder.toml, old, new)
    if "acceleration" in new:
        folder.edit(folder.toml, "jerk = 400.0", "jerk = 4.0")
    with pytest.raises(RobotFileError, match=rf"robot\.toml:\d+: {re.escape(key)}: .*{re.escape(problem)}"):
        robots.load(folder.path)


def test_no_window_is_wider_than_its_cap(folder: RobotFolder) -> None:
    """Also of an arm that no file has made."""
    arm = robots.load(folder.path)
    loose = arm.controller.model_copy(update={"position_gain": (1e-6,) * arm.n})
    window = following_error_window(arm.model_copy(update={"controller": loose}), 0.004)
    assert window.tolist() == [LARGEST_WINDOW["revolute"]] * arm.n
