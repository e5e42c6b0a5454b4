"""The demonstration over SocketCAN: strict in the virtual time of a user-mode kernel, or on an own device."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.recording.capture import Capture
from daq.recording.frames import Frames
from daq.recording.reader import read_capture, read_frames
from robots.arrays import FloatArray
from tests.drivers.test_vcan import ROOT, TOOL, needs_device, needs_tool, own_device

STAMPS = 0.0001
"""s; every look at the clock takes a little virtual time, and there is not always the same number of looks:
up to 0.06 ms were seen. A frame of another cycle would be 4 ms away."""
SYNC, PROCESS_DATA = 0x80, (0x180, 0x580)


def demo(out: Path, device: str, *before: str) -> tuple[Capture, dict[str, Any]]:
    """Capture and result of a short demonstration, run directly or behind a command."""
    options = ["--duration", "4", "--periods", "1", "--evaluations", "100", "--seed", "6"]
    command = [sys.executable, "-m", "daq", "demo", "--interface", "socketcan", "--channel", device]
    done = subprocess.run(
        [*before, *command, "--out", str(out), *options],
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert done.returncode in {0, 1}, done.stdout + done.stderr  # 1: a verdict that warns
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["estimates"]["iv"] is not None, result["instrumental_reason"]
    assert result["test"]["verdict"] != "not_testable"
    assert (out / "report.html").stat().st_size > 0
    capture = read_capture(out / "capture.mcap")
    assert not capture.damage
    assert capture.outcome is not None and capture.outcome["outcome"] == "completed"
    assert capture.run["channel"] == f"socketcan:{device}"
    return capture, result


def by_identifier(frames: Frames) -> Frames:
    """Each identifier in its own order: two processes that are due at one instant send in either order."""
    return frames.select(np.argsort(frames.can_id, kind="stable"))


def since_sync(frames: Frames) -> FloatArray:
    """Seconds from the first SYNC to each SYNC and PDO; a heartbeat's phase is when its process began."""
    first = frames.stamp[frames.can_id == SYNC].min()
    low, high = PROCESS_DATA
    cyclic = (frames.can_id == SYNC) | ((frames.can_id >= low) & (frames.can_id < high))
    return np.asarray((frames.stamp[cyclic] - first) * 1e-9)


@pytest.mark.slow
@needs_tool
@pytest.mark.timeout(600)
def test_in_virtual_time_no_cycle_is_lost_and_every_run_is_the_same(tmp_path: Path) -> None:
    before = (str(TOOL), "-v", "-t", "250", "--")
    (first, result), (second, other) = (
        demo(tmp_path / name, "vcan0", *before) for name in ("first", "second")
    )
    assert result["estimates"] == other["estimates"] and result["test"] == other["test"]
    for capture in (first, second):
        assert capture.outcome is not None
        counted = {key: capture.outcome[key] for key in capture.outcome if key.endswith("_cycles")}
        assert counted == {"missed_cycles": "0", "late_cycles": "0", "incomplete_cycles": "0"}
        assert np.abs(capture.samples.lateness).max() < 0.0001
    for column in ("cycle", "reference", "position", "control_signal", "statusword", "complete"):
        np.testing.assert_array_equal(getattr(first.samples, column), getattr(second.samples, column), column)
    frames, others = (by_identifier(read_frames(capture.path)) for capture in (first, second))
    assert len(frames) == len(others) > 10 * len(first.samples)
    for column in ("can_id", "is_rtr", "is_extended", "is_error", "dlc", "data"):
        np.testing.assert_array_equal(getattr(frames, column), getattr(others, column), column)
    apart = since_sync(frames) - since_sync(others)
    assert np.abs(apart).max() < STAMPS


@needs_device
def test_on_a_device_of_this_machine(tmp_path: Path) -> None:
    capture, _ = demo(tmp_path, str(own_device()))
    assert capture.outcome is not None
    assert int(capture.outcome["missed_cycles"]) + int(capture.outcome["incomplete_cycles"]) <= 50
