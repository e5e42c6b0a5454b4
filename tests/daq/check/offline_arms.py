"""Checks of simulated arms without a bus and without waiting: the drives and the plant in offline time.

Everything but the stream is what ``armhil check`` does: arm, run and noise in the catalogue, a capture, then
identification, comparison and verdict.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from daq.catalogue import arms, baselines, runs
from daq.catalogue.identity import identity_of_arm, sha256_of
from daq.check.recorded import TRAJECTORY, TRAJECTORY_SHA256, Recorded
from daq.check.request import CheckRequest
from daq.check.simulated_night import with_own_noise
from daq.files.checksum import file_sha256
from daq.recording.recorder import Recorder
from daq.recording.run_facts import run_facts
from daq.recording.trajectory_file import SUFFIX, write_trajectory
from daq.session.motions import read_trajectory
from daq.text.progress import Steps
from drivers.simulated import draw_truth, load_scenario, simulate_offline
from drivers.simulated.group import serial_number
from drivers.simulated.scenario import EMPTY
from robots import Robot
from trajectories import plan


def write_motion(robot: Robot, folder: Path, duration: float, evaluations: int = 300) -> Path:
    """A planned motion from where the arm rests, in a file."""
    file = folder / f"motion{SUFFIX}"
    home = np.array(robot.home)
    cycle_time = robot.bus.cycle_time
    motion = plan(
        robot, cycle_time=cycle_time, duration=duration, seed=0, evaluations=evaluations, start=home
    )
    write_trajectory(file, motion, robot)
    return file


def record_offline(request: CheckRequest, steps: Steps, watcher: object, conducting: object) -> Recorded:
    """In place of :func:`daq.check.recorded.record_check`."""
    catalogue, robot = request.catalogue, request.arm.robot
    order = with_own_noise(request.arm, catalogue)
    assert request.trajectory is not None
    assert order.noise_seed is not None
    serials = tuple(serial_number(robot, order.seed, axis) for axis in range(robot.n))
    identity = replace(identity_of_arm(robot, simulated=True), serials=serials)
    trajectory = read_trajectory(request.trajectory, robot)
    facts = {
        TRAJECTORY: str(request.trajectory),
        TRAJECTORY_SHA256: sha256_of(request.trajectory.read_text(encoding="utf-8")),
        "noise_seed": order.noise_seed,
    }
    path = request.folder / "capture.mcap"
    run = runs.begin(catalogue, identity, "check", capture=str(path), facts=facts)
    simulated = simulate_offline(
        robot,
        draw_truth(robot, order.seed),
        trajectory.position,
        scenario=EMPTY if order.scenario is None else load_scenario(order.scenario),
        seed=order.noise_seed,
    )
    with Recorder(path, robot, run_facts(robot, {"kind": "simulated"}, trajectory, ())) as recorder:
        recorder.write(simulated.samples())
        recorder.finish({"outcome": "completed", "reason": "", "cycles": str(len(simulated.cycle))})
    runs.finish(catalogue, run.id, "completed", capture_sha256=file_sha256(path))
    celsius = None if request.celsius is None else (request.celsius,) * robot.n
    arm = arms.register(catalogue, identity)
    counts = baselines.current(catalogue, arm.id)
    return Recorded(arm, run.id, path, celsius, baseline=None if counts is None else counts.id)
