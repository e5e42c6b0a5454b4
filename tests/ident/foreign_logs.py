"""The logs of a plant that is not ours, as armhil reads them: description and recordings."""

from __future__ import annotations

import io
import json
import lzma
from pathlib import Path

import numpy as np

import robots
from ident import Recording
from robots import Robot

CLEAN = ("log_03", "log_06", "clean_prior")


def foreign_robot(data: Path, folder: Path) -> Robot:
    """The arm of ``arm.json`` as its README describes it; ``folder`` gets robot.toml and URDF."""
    arm = json.loads((data / "arm.json").read_text())
    law, n = arm["controller"], len(arm["mass_kg"])
    lower, upper, speed = (np.deg2rad(arm[k]) for k in ("q_min_deg", "q_max_deg", "speed_max_deg_s"))
    lines = [
        "format = 1",
        'name = "foreign"',
        'description = "a plant that is not ours"',
        'urdf = "arm.urdf"',
    ]
    lines += [f"home = {[0.0] * n}", f"transmission = {np.eye(n).tolist()}"]
    for j in range(n):
        lines += ["[[joint]]", f'name = "q{j + 1}"', f"position = [{lower[j] + 1e-6}, {upper[j] - 1e-6}]"]
        lines += [f"velocity = {speed[j] - 1e-6}", "acceleration = 40.0", "jerk = 4000.0"]
        lines += [f"torque = {arm['torque_limit_nm'][j]}"]
    for j in range(n):
        lines += ["[[drive]]", f"node_id = {j + 1}", "encoder_counts = 31416", "gear = 100.0"]
        lines += ["control_signal = { index = 0x6077, subindex = 0, per_count = 0.0005 }"]
        lines += [f"gain = {arm['drive_gain_nm_per_unit'][j]}", "gain_relative_uncertainty = 0.02"]
        inertia, viscous, coulomb = (arm[k][j] for k in ("rotor_inertia_kgm2", "viscous", "coulomb"))
        lines += [f"dynamics = {{ inertia = {inertia}, viscous = {viscous}, coulomb = {coulomb} }}"]
    lines += ["[controller]", 'type = "cascade_p_pi"', "sample_time = 0.001", 'interpolation = "hold"']
    lines += [f"position_gain = {law['kp_1_per_s']}", f"velocity_gain = {law['kv_unit_per_rad_s']}"]
    lines += [f"integral_gain = {law['ki_1_per_s']}", f"velocity_feed_forward = {[1.0] * n}"]
    lines += ["velocity_difference_samples = 1", f"velocity_cutoff_hz = {law['velocity_filter_hz']}"]
    lines += [f"delay_samples = {law['delay_samples']}", f"saturation = {law['saturation_unit']}"]
    lines += ["[identification]", "cutoff_hz = 60.0", "decimation = 5", 'decimation_filter = "fir"']
    lines += ["derivative_accuracy = 8", "trim_samples = [100, 100]", "control_signal_lag = 0.0005"]
    lines += ["friction_width = 0.005", "minimum_speed = 0.01", "standstill_margin = 0.08"]
    (folder / "robot.toml").write_text("\n".join(lines) + "\n")
    (folder / "arm.urdf").write_text((data / "arm.urdf").read_text())
    return robots.load(folder / "robot.toml")


def foreign_log(data: Path, name: str, part: str = "fit", seconds: float = 30.0) -> Recording:
    """A log or its beginning."""
    with lzma.open(data / name / f"{part}.csv.xz", "rt") as file:
        values = np.loadtxt(io.StringIO(file.read()), delimiter=",", skiprows=1)
    values = values[: round(seconds * 1000)]
    n = (values.shape[1] - 1) // 3
    reference, position, signal = (values[:, 1 + k * n : 1 + (k + 1) * n] for k in range(3))
    return Recording(f"{name}/{part}", values[:, 0], reference, position, signal)
