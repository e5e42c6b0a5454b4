"""Captures for the tests: samples with known numbers, recorded in chunks of known length."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest

from daq.recording import recorder
from daq.recording.capture import DESCRIPTION, RUN, TRAJECTORY, CaptureError, Facts
from daq.recording.frames import Frames
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from drivers import Samples
from robots import Robot

PERIOD = 0.001
BATCH = 50
"""Cycles of one chunk."""


def samples(first: int, count: int, joints: int = 6, period: float = PERIOD) -> Samples:
    """Cycles ``first`` and following; the numbers of a cycle depend on nothing but its number."""
    cycle = np.arange(first, first + count, dtype=np.int64)
    phase = cycle[:, np.newaxis] + np.linspace(0.1, 0.9, joints)
    return Samples(
        cycle=cycle,
        time=cycle * period,
        reference=np.sin(phase / 100),
        position=np.sin(phase / 100 - 0.01),
        control_signal=np.cos(phase / 50),
        # Bits 8 to 15 change, the power state (operation enabled) does not.
        statusword=((0x1237 + 256 * (cycle[:, np.newaxis] % 7 + np.arange(joints))) & ~0x800).astype(
            np.uint16
        ),
        complete=np.ones((count, joints), dtype=np.bool_),
        lateness=np.sin(cycle) * 1e-5,
    )


def traffic(robot: Robot, cycles: int, start_ns: int = 1_700_000_000_000_000_000) -> Frames:
    """What passes on the bus in so many cycles of 1 ms, with an emergency and an error frame among it."""
    nodes = [drive.node_id for drive in robot.drive]
    ids = [0x080, *(0x200 + node for node in nodes), *(0x180 + node for node in nodes), 0x700 + nodes[0]]
    sizes = [0, *[6] * len(nodes), *[8] * len(nodes), 1]
    frames = Frames.empty(cycles * len(ids))
    frames.stamp[:] = start_ns + np.arange(len(frames)) * (1_000_000 // len(ids))
    frames.can_id[:] = np.tile(ids, cycles)
    frames.dlc[:] = np.tile(sizes, cycles)
    numbers = np.arange(8 * len(frames)).reshape(-1, 8) % 251
    frames.data[:] = np.where(np.arange(8) < frames.dlc[:, np.newaxis], numbers, 0)
    frames.data[frames.can_id > 0x700] = [5, 0, 0, 0, 0, 0, 0, 0]
    if cycles > 20:
        frames.can_id[10 * len(ids)] = 0x080 + nodes[1]
        frames.dlc[10 * len(ids)] = 8
        frames.data[10 * len(ids)] = [0x10, 0x43, 0x08, 0, 0, 0, 0, 0]
        frames.is_error[20 * len(ids)] = True
        frames.can_id[20 * len(ids)] = 0x040
    return frames


def facts(robot: Robot, period: float = PERIOD) -> dict[str, Facts]:
    """What is known before the first sample."""
    return {
        DESCRIPTION: {
            "name": robot.name,
            "robot.toml": robot.source_text,
            "urdf": robot.urdf_path.read_text(encoding="utf-8"),
            "joints": "\n".join(joint.name for joint in robot.joint),
        },
        RUN: {"period": repr(period), "channel": "test"},
        TRAJECTORY: {"family": "test", "seed": "0"},
    }


def outcome(cycles: int) -> Facts:
    return {"outcome": "completed", "reason": "", "cycles": str(cycles)}


def record(
    path: Path, robot: Robot, batches: list[Samples], monkeypatch: pytest.MonkeyPatch, period: float = PERIOD
) -> Path:
    """Record the batches as a chunk each, closed with an outcome."""
    monkeypatch.setattr(recorder, "FLUSH_INTERVAL", 0.0)
    with Recorder(path, robot, facts(robot, period), start_ns=1_700_000_000_000_000_000) as file:
        for batch in batches:
            file.write(batch)
        file.finish(outcome(int(batches[-1].cycle[-1]) + 1))
    return path


def record_cycles(path: Path, robot: Robot, cycles: int, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Record cycles 0 to ``cycles`` − 1 in chunks of ``BATCH``."""
    batches = [samples(at, min(BATCH, cycles - at), robot.n) for at in range(0, cycles, BATCH)]
    return record(path, robot, batches, monkeypatch)


class FailingFile:
    """A file whose disk fails, with an error of the system, after so many bytes more."""

    def __init__(self, file: BinaryIO, room: int, number: int) -> None:
        self._file, self._room, self._number = file, room, number

    def write(self, data: bytes) -> int:
        self._room -= len(data)
        if self._room < 0:
            raise OSError(self._number, os.strerror(self._number))
        return self._file.write(data)

    def flush(self) -> None:
        self._file.flush()

    def fileno(self) -> int:
        return self._file.fileno()


def samples_in(path: Path) -> int:
    """How many samples a capture holds by now, while it is being written; 0 where there is none yet."""
    try:
        return len(read_capture(path, allow_empty=True).samples)
    except (CaptureError, OSError):  # its records are not all there yet
        return 0
