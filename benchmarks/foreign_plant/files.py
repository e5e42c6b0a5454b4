"""Logs, description and truth as files that armhil reads."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from benchmarks.foreign_plant.arms import Arm
from benchmarks.foreign_plant.effects import NAMES, OUTSIDE, Effect
from benchmarks.foreign_plant.model import urdf
from benchmarks.foreign_plant.record import QUANTUM, Gains, Log, gains
from benchmarks.foreign_plant.settings import Settings


def write_description(folder: Path, arm: Arm, settings: Settings) -> None:
    """``arm.urdf``, ``robot.toml`` and ``import.toml``: the nominal arm, rightly described."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.urdf").write_text(urdf(arm))
    (folder / "robot.toml").write_text(_robot(arm, settings, gains(arm, settings)))
    names = {kind: _list(f'"{kind}_{j + 1}"' for j in range(arm.n)) for kind in ("q", "q_ref", "v")}
    (folder / "import.toml").write_text(
        f"""format = 1
[time]
column = "t"
unit = "s"
[position]
columns = {names["q"]}
unit = "rad"
[reference]
columns = {names["q_ref"]}
unit = "rad"
[control_signal]
columns = {names["v"]}
"""
    )


def write_log(path: Path, log: Log) -> None:
    """A CSV file with t, q_ref, q and v of each joint."""
    n = log.position.shape[1]
    names = ["t", *(f"{kind}_{j + 1}" for kind in ("q_ref", "q", "v") for j in range(n))]
    table = np.column_stack([log.time, log.reference, log.position, log.control_signal])
    text = io.StringIO()
    csv.writer(text).writerow(names)
    np.savetxt(text, table, fmt=["%.6f", *["%.9f"] * n, *["%.6f"] * n, *["%.6f"] * n], delimiter=",")
    path.write_text(text.getvalue())


def write_truth(path: Path, arm: Arm, settings: Settings, effects: tuple[Effect, ...], seed: int) -> None:
    """What is hidden, how large, and how the log was made."""
    found = [{"name": e.name, "joint": e.joint + 1, "size": e.size, "unit": NAMES[e.name]} for e in effects]
    truth = {
        "arm": arm.name,
        "seed": seed,
        "effects": found,
        "in_vocabulary": all(e.name not in OUTSIDE for e in effects),
        "settings": asdict(settings),
    }
    path.write_text(json.dumps(truth, indent=1) + "\n")


def _list(values: object) -> str:
    return "[" + ", ".join(str(value) for value in values) + "]"  # type: ignore[attr-defined]


def _numbers(values: np.ndarray) -> str:
    return _list(f"{float(value):.12g}" for value in values)


def _robot(arm: Arm, settings: Settings, figures: Gains) -> str:
    home = _numbers(np.array([sum(link.travel) / 2 for link in arm.links]))
    unit = "[" + ",\n  ".join(_list(float(j == k) for k in range(arm.n)) for j in range(arm.n)) + "]"
    joints = "".join(
        f"""
[[joint]]
name = "q{j}"
position = [{link.travel[0]}, {link.travel[1]}]
velocity = {link.speed}
acceleration = 40.0
jerk = 4000.0
torque = {link.torque}
"""
        for j, link in enumerate(arm.links, start=1)
    )
    counts = round(2 * np.pi / QUANTUM / 100.0)
    drives = "".join(
        f"""
[[drive]]
node_id = {j}
encoder_counts = {counts}
gear = 100.0
control_signal = {{ index = 0x6077, subindex = 0, per_count = 0.001 }}
gain = {link.gain * (1.0 + settings.gain_error):.12g}
gain_relative_uncertainty = {max(0.02, abs(settings.gain_error))}
dynamics = {{ inertia = {link.rotor}, viscous = {link.viscous}, coulomb = {link.coulomb} }}
"""
        for j, link in enumerate(arm.links, start=1)
    )
    return f"""# Written by benchmarks.foreign_plant.
format = 1
name = "{arm.name}"
description = "foreign plant: {arm.name}"
urdf = "arm.urdf"
gravity = [0.0, 0.0, -9.81]
home = {home}
transmission = {unit}
{joints}{drives}
{_controller(arm, settings, figures)}
[identification]
cutoff_hz = 60.0
filter_order = 4
decimation = 5
decimation_filter = "fir"
derivative_accuracy = 8
trim_samples = [100, 100]
control_signal_lag = {0.5 / settings.rate}
friction_sign = "tanh"
friction_width = 0.005
minimum_speed = 0.01
standstill_margin = 0.08
"""


def _controller(arm: Arm, settings: Settings, figures: Gains) -> str:
    period = 1.0 / settings.rate
    cascade = settings.law == "p_pi"
    more = ""
    if settings.law == "pd":
        more = (
            f"friction_feed_forward = {_numbers(figures.viscous)}\n"
            f"acceleration_feed_forward = {_numbers(figures.inertia)}\n"
        )
    return f"""[controller]
type = "{"cascade_p_pi" if cascade else "pid"}"
sample_time = {period}
position_gain = {_numbers(figures.position)}
velocity_gain = {_numbers(figures.velocity)}
integral_gain = {_numbers(figures.integral)}
velocity_feed_forward = {_numbers(np.full(arm.n, settings.feed_forward))}
velocity_difference_samples = 1
velocity_cutoff_hz = 200.0
delay_samples = {1 if cascade else 0}
saturation = {_numbers(figures.limit)}
interpolation = "hold"
{more}"""
