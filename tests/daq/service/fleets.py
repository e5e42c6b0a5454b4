"""A fleet of one simulated arm with a short motion, for checks that the service starts."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.recording.trajectory_file import SUFFIX, write_trajectory
from drivers import Channel
from robots import Robot
from trajectories import plan


def write_fleet(file: Path, emps: Robot, channel: Channel) -> None:
    """One simulated arm with a short motion."""
    motion = file.parent / f"motion{SUFFIX}"
    home = np.array(emps.home)
    write_trajectory(
        motion,
        plan(emps, cycle_time=emps.bus.cycle_time, duration=4.0, seed=0, evaluations=300, start=home),
        emps,
    )
    lines = ["format = 1", "[[arm]]", 'robot = "emps"', "simulated = true", f'trajectory = "{motion}"']
    lines += [f'interface = "{channel.interface}"', f'channel = "{channel.name}"']
    file.write_text("\n".join(lines) + "\n")
