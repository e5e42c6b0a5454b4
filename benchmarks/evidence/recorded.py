"""Logs that lie in the shared data: eleven of a foreign plant with their truth, and of three real arms."""

from __future__ import annotations

import json
import lzma
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.io import loadmat

import robots
from benchmarks.evidence.case import UNKNOWN, Case, Truth
from daq.importing.load import load_recording
from ident import Recording
from ident.discrepancy.prior import described_prior
from robots import Robot
from robots.controller_description import Controller

_GEARS = (1798 / 7, 1872 / 7, 757 / 3, 221.0, 5032 / 21, 206793 / 1340)
_ZEROS = (0.0, -90.0, 90.0, 0.0, 0.0, 0.0)
_KUKA_LIMITS = ((-2.56, 2.56), (-2.44, -0.09), (-1.95, 2.67), (-6.1, 6.1), (-2.13, 2.13), (-6.1, 6.1))
_KUKA_SPEEDS = (1.79, 1.59, 1.69, 2.39, 2.39, 3.49)
_KUKA_TORQUES = (11900.0, 12400.0, 11400.0, 5900.0, 5900.0, 3900.0)
_KUKA_FRICTION = (
    (800.0, 700.0),
    (800.0, 700.0),
    (600.0, 600.0),
    (150.0, 200.0),
    (150.0, 200.0),
    (80.0, 120.0),
)
"""Viscous and Coulomb, N·m·s/rad and N·m: a guess, 5 to 7 % of the limits, for the scales of effects."""


def recorded(data: Path, folder: Path) -> dict[str, Callable[[], Case]]:
    """Every case by its name, read when it is asked for.

    Args:
        data: the shared data.
        folder: for descriptions of arms; it has to live as long as the cases.
    """
    foreign, kuka = data / "foreign", data / "kr300"
    logs = [log.name for log in sorted(foreign.glob("log_*"))]
    return {
        **{name: partial(_foreign, foreign, folder, name) for name in logs},
        "EMPS": partial(_emps, data, (), "asymmetric_friction"),
        "EMPS without Coulomb": partial(_emps, data, ("coulomb_friction",), "coulomb_friction"),
        "TX40": partial(_tx40, data, ()),
        "TX40 without coupling": partial(_tx40, data, ("wrist_coupling",)),
        "KR300 A": partial(_kuka, kuka, folder, "A", "B"),
        "KR300 B": partial(_kuka, kuka, folder, "B", "A"),
        "KR300 A by its URDF": partial(_kuka, kuka, folder, "A", "B", by_urdf=True),
        "KR300 B by its URDF": partial(_kuka, kuka, folder, "B", "A", by_urdf=True),
    }


def _foreign(data: Path, folder: Path, name: str) -> Case:
    truth = json.loads((data / name / "truth.json").read_text(encoding="utf-8"))
    arm = foreign_robot(data, folder)
    accepted, fit, held = (
        foreign_log(data, log, part)
        for log, part in (("clean_prior", "fit"), (name, "fit"), (name, "validate"))
    )
    return Case(name, "foreign", arm, fit, held, _truth(truth["effects"], truth["in_vocabulary"]), accepted)


def _truth(effects: list[dict[str, object]], within: bool) -> Truth:
    found = []
    for effect in effects:
        joints = tuple(effect["joints"])  # type: ignore[arg-type]
        whole = len(joints) > 2
        found.append((str(effect["id"]) if within else UNKNOWN, () if whole else joints))
    return tuple(found)


def foreign_robot(data: Path, folder: Path) -> Robot:
    """The arm of ``arm.json`` as its README describes it; ``folder`` gets its description."""
    arm = json.loads((data / "arm.json").read_text(encoding="utf-8"))
    inside = 1.0 - 1e-6
    lower, upper, speed = (inside * np.radians(arm[k]) for k in ("q_min_deg", "q_max_deg", "speed_max_deg_s"))
    joints = [
        _joint(
            "q", j, lower[j], upper[j], speed[j], arm["torque_limit_nm"][j], arm["drive_gain_nm_per_unit"][j]
        )
        + f"dynamics = {{ inertia = {arm['rotor_inertia_kgm2'][j]}, viscous = {arm['viscous'][j]},"
        f" coulomb = {arm['coulomb'][j]} }}\n"
        for j in range(6)
    ]
    law = arm["controller"]
    text = _head("foreign", "arm.urdf", [0.0, 0.0, 1.5707, 0.0, 0.5, 0.0]) + "".join(joints)
    text += f"""[controller]
type = "cascade_p_pi"
sample_time = 0.001
position_gain = {law["kp_1_per_s"]}
velocity_gain = {law["kv_unit_per_rad_s"]}
integral_gain = {law["ki_1_per_s"]}
velocity_feed_forward = {[1.0] * 6}
velocity_difference_samples = 1
velocity_cutoff_hz = {law["velocity_filter_hz"]}
delay_samples = {law["delay_samples"]}
saturation = {law["saturation_unit"]}
interpolation = "hold"
[identification]
cutoff_hz = 60.0
decimation = 5
decimation_filter = "fir"
derivative_accuracy = 8
trim_samples = [100, 100]
control_signal_lag = 0.0005
friction_sign = "tanh"
friction_width = 0.005
minimum_speed = 0.01
standstill_margin = 0.08
"""
    return _loaded(folder / "foreign", text, "arm.urdf", (data / "arm.urdf").read_text(encoding="utf-8"))


def foreign_log(data: Path, name: str, part: str, seconds: float | None = None) -> Recording:
    """One log, ``fit`` or ``validate``, or the beginning of it."""
    most = None if seconds is None else round(1000 * seconds)
    with lzma.open(data / name / f"{part}.csv.xz", "rt") as file:
        rows = np.loadtxt(file, delimiter=",", skiprows=1, max_rows=most)
    return Recording(f"{name} {part}", rows[:, 0], rows[:, 1:7], rows[:, 7:13], rows[:, 13:19])


def _emps(data: Path, without: tuple[str, ...], truth: str) -> Case:
    robot = robots.load("emps")
    loaded = load_recording(data / "emps" / "DATA_EMPS.mat", robot)
    robot = robot.model_copy(update={"identification": loaded.settings})
    (whole,) = loaded.recordings
    name = "EMPS without Coulomb" if without else "EMPS"
    return Case(name, "real", robot, *_halves(whole), ((truth, (1,)),), without=without)


def _tx40(data: Path, without: tuple[str, ...]) -> Case:
    robot = robots.load("tx40")
    loaded = load_recording(data / "tx40", robot)
    robot = robot.model_copy(update={"identification": loaded.settings})
    (whole,) = loaded.recordings
    name = "TX40 without coupling" if without else "TX40"
    truth = (("wrist_coupling", (5, 6)),) if without else None
    return Case(name, "real", robot, *_halves(whole), truth, without=without)


def _halves(whole: Recording) -> tuple[Recording, Recording]:
    middle = whole.time.shape[0] // 2
    return _cut(whole, slice(None, middle)), _cut(whole, slice(middle, None))


def _cut(whole: Recording, part: slice) -> Recording:
    reference = None if whole.reference is None else whole.reference[part]
    return replace(
        whole,
        time=whole.time[part],
        reference=reference,
        position=whole.position[part],
        control_signal=whole.control_signal[part],
    )


def _kuka(data: Path, folder: Path, fit: str, held: str, by_urdf: bool = False) -> Case:
    """What is true of this arm is in the README, and no list of names says all of it.

    Its controller is not published, and the one that is described for the file to be read goes again. After a
    refit, or against the bodies of its URDF, as ``--prior cad``: they know nothing of the counterbalance of
    joint 2.
    """
    joints = [
        _joint("joint_", j, *_KUKA_LIMITS[j], _KUKA_SPEEDS[j], _KUKA_TORQUES[j], _GEARS[j])
        + f"dynamics = {{ inertia = {0.01 * _GEARS[j] ** 2 / 4:.6g}, viscous = {_KUKA_FRICTION[j][0]},"
        f" coulomb = {_KUKA_FRICTION[j][1]} }}\n"
        for j in range(6)
    ]
    text = _head("kr300", "kr300.urdf", [0.0, -1.57, 1.57, 0.0, 0.5, 0.0]) + "".join(joints)
    text += f"""[controller]
type = "pd"
sample_time = 0.004
position_gain = {[1e4] * 6}
velocity_gain = {[100.0] * 6}
integral_gain = {[0.0] * 6}
velocity_feed_forward = {[1.0] * 6}
saturation = {[60.0] * 6}
[identification]
cutoff_hz = 25.0
decimation = 2
trim_samples = [50, 50]
friction_sign = "sign"
minimum_speed = 0.01
standstill_margin = 0.08
"""
    arm = _loaded(folder / "kr300", text, "kr300.urdf", (data / "kr300.urdf").read_text(encoding="utf-8"))
    arm = arm.model_copy(update={"controller": Controller.model_construct()})
    name, logs = f"KR300 {fit}", (_kuka_log(data, fit), _kuka_log(data, held))
    if not by_urdf:
        return Case(name, "real", arm, *logs, None)
    counterbalance = (("gravity_spring", (2,)),)
    return Case(f"{name} by its URDF", "real", arm, *logs, counterbalance, prior=described_prior)


def _kuka_log(data: Path, name: str) -> Recording:
    log = loadmat(data / name / "data.mat")["rec"][0, 0]
    time = np.ravel(log["time_cont"])
    reference, position = (
        np.radians(np.asarray(log[key]).T + _ZEROS) for key in ("ref_pos_deg", "act_pos_mot_deg")
    )
    return Recording(name, time, reference, position, np.asarray(log["act_torque_abs_nm"]).T)


def _head(name: str, urdf: str, home: list[float]) -> str:
    return f"""format = 1
name = "{name}"
description = "{name}"
urdf = "{urdf}"
gravity = [0.0, 0.0, -9.81]
home = {home}
transmission = {np.eye(6).tolist()}
"""


def _joint(name: str, j: int, lower: float, upper: float, speed: float, torque: float, gain: float) -> str:
    return f"""
[[joint]]
name = "{name}{j + 1}"
position = [{lower}, {upper}]
velocity = {speed}
acceleration = 20.0
jerk = 400.0
torque = {torque}

[[drive]]
node_id = {j + 1}
encoder_counts = 65536
gear = 50.0
control_signal = {{ index = 0x6077, subindex = 0, per_count = 0.002 }}
gain = {gain}
gain_relative_uncertainty = 0.02
"""


def _loaded(folder: Path, text: str, urdf: str, model: str) -> Robot:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.toml").write_text(text, encoding="utf-8")
    (folder / urdf).write_text(model, encoding="utf-8")
    return robots.load(str(folder))
