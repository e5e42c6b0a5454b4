"""Arms and recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import robots
from daq.api.frames import frame
from daq.api.picture import Picture, traces
from daq.importing.load import load_recording as load
from daq.importing.loaded import LoadedRecordings
from daq.recording.capture import CAPTURE_SUFFIX, DESCRIPTION, MESHES, RUN, TRAJECTORY, CaptureError
from daq.recording.described_arm import robot_of
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from drivers.simulated import Scenario, draw_truth, load_scenario, simulate_offline
from drivers.simulated.drawing import exercise
from robots import Robot
from robots.identity import mesh_checksums

Place = str | Path
"""A path; strings do."""


def load_arm(source: Place) -> Robot:
    """An arm: name of one that ships, path of a robot.toml, or the folder that holds one.

    Raises:
        RobotFileError: one line with file, line, key and what is allowed.
    """
    return robots.load(source)


@dataclass(frozen=True)
class Log:
    """A recording of an arm.

    Attributes:
        arm: that it is of.
        path: of the capture, log or folder.
        loaded: its uninterrupted pieces, as the identification reads them.
    """

    arm: Robot
    path: Path
    loaded: LoadedRecordings

    def summary(self) -> str:
        """How long, how fast, of which joints, and what is missing."""
        lines = [f"{self.path.name}: {self.arm.name}, {len(self.arm.joint)} joints"]
        for number, piece in enumerate(self.loaded.recordings, start=1):
            seconds = float(piece.time[-1] - piece.time[0])
            rate = (len(piece.time) - 1) / seconds
            reference = "with" if piece.reference is not None else "without"
            lines.append(f"  piece {number}: {seconds:.1f} s at {rate:.0f} Hz, {reference} references")
        return "\n".join([*lines, *(f"  missing: {warning}" for warning in self.loaded.warnings)])

    def to_frame(self) -> Any:
        """One row per sample: time, and position, control signal and torque per joint (pandas)."""
        pieces = self.loaded.recordings
        columns: dict[str, Any] = {
            "piece": np.concatenate([np.full(len(p.time), k + 1) for k, p in enumerate(pieces)]),
            "t": np.concatenate([p.time for p in pieces]),
        }
        for axis, joint in enumerate(self.arm.joint):
            columns[f"q_{joint.name}"] = np.concatenate([p.position[:, axis] for p in pieces])
            columns[f"v_{joint.name}"] = np.concatenate([p.control_signal[:, axis] for p in pieces])
            torque = [self.arm.joint_torque(p.control_signal)[:, axis] for p in pieces]
            columns[f"tau_{joint.name}"] = np.concatenate(torque)
        return frame(columns)

    def plot(self) -> Picture:
        """Positions, and references where they were recorded, of the first piece."""
        piece = self.loaded.recordings[0]
        lines = {"position": piece.position}
        if piece.reference is not None:
            lines = {"reference": piece.reference, **lines}
        names, units = [joint.name for joint in self.arm.joint], [joint.unit for joint in self.arm.joint]
        return traces(self.path.name, names, units, piece.time, lines)


def load_recording(path: Place, arm: Robot | Place | None = None, columns: Place | None = None) -> Log:
    """A capture, or a log that a column map describes.

    Args:
        path: of the capture (.mcap), the .mat, .csv or Parquet file, or the folder.
        arm: that it is of; the capture's own description where None.
        columns: the column map of a log; ``import.toml`` beside the arm's description where None.

    Raises:
        CaptureError, RobotFileError: one line.
    """
    path = Path(path)
    robot = arm_of(arm, path)
    return Log(robot, path, load(path, robot, None if columns is None else Path(columns)))


_DESCRIPTIONS: list[TemporaryDirectory[str]] = []
"""Unpacked descriptions of captures: what is identified from one reads them as long as Python runs."""


def arm_of(arm: Robot | Place | None, first: Place | Log) -> Robot:
    """The arm that was given, else that of the log, else the one that the capture describes.

    Raises:
        CaptureError, RobotFileError: one line.
    """
    if isinstance(arm, Robot):
        return arm
    if arm is not None:
        return load_arm(arm)
    if isinstance(first, Log):
        return first.arm
    path = Path(first)
    if path.suffix.lower() != CAPTURE_SUFFIX:
        raise CaptureError(f"{path}: is no capture, so it does not say of which arm it is; give arm=")
    capture = read_capture(path)
    _DESCRIPTIONS.append(TemporaryDirectory(prefix="armhil-"))
    return robot_of(capture, Path(_DESCRIPTIONS[-1].name))


def simulated_recording(
    path: Place,
    arm: Robot | Place = "tx40",
    *,
    seed: int = 0,
    motion: int = 0,
    noise: int = 0,
    duration: float = 8.0,
    periods: int = 2,
    hidden: Mapping[str, Any] | Place | None = None,
) -> Path:
    """A capture of a simulated arm, made without a bus: what is tried before there is an arm.

    Args:
        path: of the new file; one that is there is never overwritten.
        arm: which.
        seed: of the arm: its bodies, friction and gains.
        motion: seed of the motion.
        noise: seed of the noise of this run.
        duration: of one period, s.
        periods: how often it is repeated.
        hidden: what the arm has besides: a scenario.toml, or its tables, as
            ``{"backlash": [{"drive": 2, "width": 0.002}]}``; nothing where None.

    Raises:
        CaptureError: it cannot be written.
        ScenarioError: there is no such effect, or not of this arm.
    """
    robot = arm if isinstance(arm, Robot) else load_arm(arm)
    scenario = Scenario()
    if isinstance(hidden, str | Path):
        scenario = load_scenario(hidden)
    elif hidden is not None:
        scenario = Scenario.from_dict({"format": 1, **hidden})
    scenario.check(robot)
    reference = exercise(robot, duration=duration, seed=motion)
    run = simulate_offline(
        robot, draw_truth(robot, seed), reference, scenario=scenario, periods=periods, seed=noise
    )
    path = Path(path)
    if path.exists():
        raise CaptureError(f"{path}: exists already; a capture is never overwritten")
    with Recorder(path, robot, _facts(robot, seed)) as recorder:
        recorder.write(run.samples())
        recorder.finish({"outcome": "completed", "reason": "", "cycles": str(len(run.cycle))})
    return path


def _facts(robot: Robot, seed: int) -> dict[str, dict[str, str]]:
    """Metadata of a capture that no bus was needed for."""
    run = {
        "period": repr(robot.bus.cycle_time),
        "kind": "simulated",
        "channel": "none",
        "seed": str(seed),
        "versions": json.dumps({"armhil": version("armhil")}),
    }
    description = {
        "name": robot.name,
        "robot.toml": robot.source_text,
        "urdf": robot.urdf_path.read_text(encoding="utf-8"),
        MESHES: json.dumps(mesh_checksums(robot)),
        "joints": "\n".join(joint.name for joint in robot.joint),
    }
    return {DESCRIPTION: description, RUN: run, TRAJECTORY: {"family": "exercise"}}
