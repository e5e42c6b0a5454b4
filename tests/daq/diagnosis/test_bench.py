"""What diagnose --live drives is recorded, watched, and kept when it goes wrong, as every run is."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import numpy as np
import pytest

import daq
from daq.diagnosis.bench import stream_and_record
from daq.progress import Silent
from daq.recording.reader import read_capture
from daq.service.spool import spool_path
from daq.session.session_error import RunFailed
from drivers import Channel
from drivers.simulated import Faults, SimulatedArm
from drivers.simulated.faults import EmergencyAt
from robots import Robot
from tests.daq.session.motions import there_and_back
from trajectories import Conditions, approach


def test_a_fault_on_the_bench_is_kept(emps: Robot, channel: Channel, tmp_path: Path) -> None:
    """The way to the start has a capture of its own; ten seconds around the fault are kept beside."""
    node, cycle = emps.drive[0].node_id, 900
    fault = Faults(emergencies=(EmergencyAt(node, cycle, 0x2310),))
    motion = there_and_back(emps, distance=0.05, speed=0.3, periods=3)
    path = tmp_path / "fit.mcap"
    with (
        SimulatedArm("emps", channel, 2, faults=fault),
        pytest.raises(
            RunFailed, match=r"the run ended early: .*2310.*; the arm is at rest and its torque is off"
        ),
    ):
        stream_and_record(emps, channel, motion, Conditions(), path, Silent())
    (kept,) = tmp_path.glob("fault-*.mcap")
    around, whole = read_capture(kept), read_capture(path)
    np.testing.assert_array_equal(around.samples.position, whole.samples.position)
    assert around.outcome is not None and around.outcome["outcome"] == "fault"
    # The emergency or the statusword, whichever was heard first.
    assert around.outcome["reason"].startswith("carriage: ")
    lines = [json.loads(line) for line in spool_path(path).read_text(encoding="utf-8").splitlines()]
    assert (lines[0]["kind"], lines[-1]["outcome"]) == ("begin", "fault")


def test_the_way_to_the_start_is_recorded_too(emps: Robot, channel: Channel, tmp_path: Path) -> None:
    home = np.array(emps.home)
    motion = approach(emps, home + 0.01, home, emps.bus.cycle_time, 1.0)
    with SimulatedArm("emps", channel, 2):
        stream_and_record(emps, channel, motion, Conditions(), tmp_path / "fit.mcap", Silent())
    way, fit = (read_capture(tmp_path / f"{name}.mcap") for name in ("fit-approach", "fit"))
    assert np.abs(way.samples.reference[-1] - fit.samples.reference[0]).max() < 1e-4
    assert not list(tmp_path.glob("fault-*.mcap"))


def test_nothing_in_daq_streams_without_a_fault_ring() -> None:
    """Whoever asks a session to move does it beside a fault ring."""
    beside_a_ring = {}
    for file in Path(daq.__file__).parent.rglob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
        # Path.home() takes nothing.
        moves = [c for c in calls if isinstance(c.func, ast.Attribute) and (c.args or c.keywords)]
        if {"stream", "jog", "home"} & {c.func.attr for c in moves if isinstance(c.func, ast.Attribute)}:
            names = {c.func.id for c in calls if isinstance(c.func, ast.Name)}
            beside_a_ring[file.name] = "FaultRing" in names
    assert beside_a_ring == {"streaming.py": True, "home.py": True}
