"""Logs of a plant of another engine (shared data ``foreign``), as recordings of an arm described as it is."""

from __future__ import annotations

import json
import lzma
from pathlib import Path

import numpy as np
import pytest

import robots
from ident import Recording
from robots import Robot

_HEAD = """format = 1
name = "foreign"
description = "An arm of another engine"
urdf = "arm.urdf"
gravity = {gravity}
home = [0.0, 0.0, 1.5707, 0.0, 0.5, 0.0]
transmission = {transmission}
"""

_JOINT = """
[[joint]]
name = "q{number}"
position = [{lower}, {upper}]
velocity = {speed}
acceleration = 20.0
jerk = 400.0
torque = {torque}

[[drive]]
node_id = {number}
encoder_counts = 65536
gear = 50.0
control_signal = {{ index = 0x6077, subindex = 0, per_count = 0.0005 }}
gain = {gain}
gain_relative_uncertainty = 0.02
dynamics = {{ inertia = {inertia}, viscous = {viscous}, coulomb = {coulomb} }}
"""

_INSIDE = 1.0 - 1e-6
"""Limits are rounded in the URDF, and the description's have to be inside."""

_TAIL = """
[controller]
type = "cascade_p_pi"
sample_time = 0.001
position_gain = {kp_1_per_s}
velocity_gain = {kv_unit_per_rad_s}
integral_gain = {ki_1_per_s}
velocity_feed_forward = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
velocity_cutoff_hz = 200.0
delay_samples = 1
saturation = {saturation_unit}
interpolation = "hold"

[bus]
cycle_time = 0.001

[identification]
cutoff_hz = 60.0
decimation = 10
decimation_filter = "fir"
derivative_accuracy = 4
control_signal_lag = 0.0005
friction_sign = "tanh"
friction_width = 0.005
minimum_speed = 0.01
standstill_margin = 0.08
"""


def foreign(shared_data: Path) -> Path:
    """The folder of the logs; skips where it is absent."""
    folder = shared_data / "foreign"
    if not folder.is_dir():
        pytest.skip(f"no logs of a foreign plant in {folder}")
    return folder


def foreign_robot(logs: Path, folder: Path) -> Robot:
    """The arm as its figures describe it.

    Args:
        logs: see :func:`foreign`.
        folder: to write the description to.
    """
    arm = json.loads((logs / "arm.json").read_text(encoding="utf-8"))
    joints = [
        _JOINT.format(
            number=j + 1,
            lower=_INSIDE * np.radians(arm["q_min_deg"][j]),
            upper=_INSIDE * np.radians(arm["q_max_deg"][j]),
            speed=_INSIDE * np.radians(arm["speed_max_deg_s"][j]),
            torque=arm["torque_limit_nm"][j],
            gain=arm["drive_gain_nm_per_unit"][j],
            inertia=arm["rotor_inertia_kgm2"][j],
            viscous=arm["viscous"][j],
            coulomb=arm["coulomb"][j],
        )
        for j in range(6)
    ]
    text = (
        _HEAD.format(**arm, transmission=np.eye(6).tolist())
        + "".join(joints)
        + _TAIL.format(**arm["controller"])
    )
    (folder / "robot.toml").write_text(text, encoding="utf-8")
    (folder / "arm.urdf").write_text((logs / "arm.urdf").read_text(encoding="utf-8"), encoding="utf-8")
    return robots.load(str(folder))


def foreign_log(logs: Path, name: str, part: str) -> Recording:
    """One log, ``fit`` or ``validate``."""
    with lzma.open(logs / name / f"{part}.csv.xz", "rt") as file:
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
    return Recording(f"{name} {part}", rows[:, 0], rows[:, 1:7], rows[:, 7:13], rows[:, 13:19])
