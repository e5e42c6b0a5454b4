"""Two captures of the one-axis arm, without and with a known payload, and the payload's file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from daq.recording.recorder import Recorder
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from robots import Robot
from tests.daq.captures import facts, outcome

MASS = 60.0
GAIN_ERROR = 0.05
"""The true gain over the described one, less one."""

PAYLOAD = f"""format = 1
mass = {MASS}
center = [0.0, 0.0, 0.1]
inertia = [0.4, 0.0, 0.4, 0.0, 0.0, 0.4]
relative_uncertainty = 0.001
"""


def write_payload_captures(robot: Robot, folder: Path) -> tuple[Path, Path, Path]:
    """Write unloaded.mcap, loaded.mcap and payload.toml; returns their paths.

    The captures carry a description whose gain is ``GAIN_ERROR`` too low.
    """
    payload = folder / "payload.toml"
    payload.write_text(PAYLOAD, encoding="utf-8")
    truth = draw_truth(robot, 5)
    loaded = replace(truth, parameters={**truth.parameters, "M1": truth.parameters["M1"] + MASS}, seed=6)
    paths = folder / "unloaded.mcap", folder / "loaded.mcap"
    for path, arm, phase in zip(paths, (truth, loaded), (0.0, 1.0), strict=True):
        run = simulate_offline(robot, arm, _motion(robot, phase))
        samples = replace(run.samples(), control_signal=run.control_signal / (1.0 + GAIN_ERROR))
        with Recorder(path, robot, facts(robot, robot.bus.cycle_time)) as recorder:
            recorder.write(samples)
            recorder.finish(outcome(len(samples)))
    return (*paths, payload)


def _motion(robot: Robot, phase: float) -> np.ndarray:
    """Three sines from rest to rest, N × 1."""
    t = np.arange(0.0, 6.0, robot.bus.cycle_time)
    window = np.minimum(1.0, np.minimum(t, t[-1] - t)) ** 3
    tones = ((0.03, 0.5), (0.012, 1.3), (0.004, 2.9))
    waves = sum(size * np.sin(2 * np.pi * f * t + k * phase) for k, (size, f) in enumerate(tones))
    return np.asarray(window * waves)[:, np.newaxis]
