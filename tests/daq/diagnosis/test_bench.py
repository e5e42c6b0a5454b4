"""What diagnose --live drives goes through the door of every run, is asked for, recorded and kept."""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import daq
from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.diagnosis.bench import LiveArm
from daq.recording.reader import read_capture
from daq.session.bench import opened
from daq.session.cell import Cell
from daq.session.motion_words import speed_share
from daq.session.recorded_runs import unconducted
from daq.session.session_error import NotMoved, RunFailed
from daq.session.spool import spool_path
from daq.session.watching import Nobody
from daq.text.progress import Silent
from drivers import Channel
from drivers.simulated import Faults, SimulatedArm
from drivers.simulated.faults import EmergencyAt
from robots import Robot
from tests.daq.session.commissioned import commissioned, real_identity
from tests.daq.session.motions import order, refusing, there_and_back
from trajectories import approach


@contextmanager
def live_arm(robot: Robot, channel: Channel, asked: list[str] | None = None) -> Iterator[LiveArm]:
    """Its drives are there already, and it has been commissioned."""
    confirm = (lambda question: True) if asked is None else refusing(asked)
    with Catalogue() as catalogue:
        its = order(robot, channel)
        with opened(its, catalogue, Silent(), "drive", Cell()) as arm:
            yield LiveArm(arm, its, catalogue, Cell(), confirm, Nobody(), unconducted)


def test_a_fault_on_the_bench_is_kept(emps: Robot, channel: Channel, tmp_path: Path) -> None:
    """Ten seconds around the fault are kept beside."""
    node, cycle = emps.drive[0].node_id, 900
    fault = Faults(emergencies=(EmergencyAt(node, cycle, 0x2310),))
    motion = there_and_back(emps, distance=0.05, speed=0.3, periods=3)
    path = tmp_path / "fit.mcap"
    commissioned(real_identity(emps, 2))
    with (
        SimulatedArm("emps", channel, 2, faults=fault),
        live_arm(emps, channel) as live,
        pytest.raises(
            RunFailed, match=r"the run ended early: .*2310.*; the arm is at rest and its torque is off"
        ),
    ):
        live.drive(motion, path, "to record fit.mcap")
    (kept,) = tmp_path.glob("fault-*.mcap")
    around, whole = read_capture(kept), read_capture(path)
    np.testing.assert_array_equal(around.samples.position, whole.samples.position)
    assert around.outcome is not None and around.outcome["outcome"] == "fault"
    # The emergency or the statusword, whichever was heard first.
    assert around.outcome["reason"].startswith("carriage: ")
    lines = [json.loads(line) for line in spool_path(path).read_text(encoding="utf-8").splitlines()]
    assert (lines[0]["kind"], lines[-1]["outcome"]) == ("begin", "fault")


@pytest.mark.slow
def test_asked_for_slowed_to_what_the_arm_has_passed_and_recorded_with_its_way(
    emps: Robot, channel: Channel, tmp_path: Path
) -> None:
    home = np.array(emps.home)
    motion = approach(emps, home + 0.03, home, emps.bus.cycle_time, 1.0)
    passed = 0.5 * speed_share(emps, motion)
    commissioned(real_identity(emps, 2), speed=passed)
    asked: list[str] = []
    with SimulatedArm("emps", channel, 2):
        with (
            live_arm(emps, channel, asked) as live,
            pytest.raises(NotMoved, match=r"the motion to record fit\.mcap was not confirmed"),
        ):
            live.drive(motion, tmp_path / "fit.mcap", "to record fit.mcap")
        (question,) = asked
        assert "First, slowly, to where the motion begins" in question
        assert "Then the motion to record fit.mcap," in question and not list(tmp_path.glob("*.mcap"))
        with live_arm(emps, channel) as live:
            live.drive(motion, tmp_path / "fit.mcap", "to record fit.mcap")
    way, fit = (read_capture(tmp_path / f"{name}.mcap") for name in ("fit-approach", "fit"))
    assert np.abs(way.samples.reference[-1] - fit.samples.reference[0]).max() < 1e-4
    fastest = np.abs(np.diff(fit.samples.reference, axis=0)).max() / emps.bus.cycle_time
    assert fastest / emps.velocity_limits[0] == pytest.approx(passed, rel=0.02)
    assert not list(tmp_path.glob("fault-*.mcap"))
    with Catalogue() as catalogue:
        assert [run.stage for run in runs.every(catalogue, kind="run")] == ["diagnosis", "approach"]


def test_nothing_in_daq_streams_without_a_fault_ring() -> None:
    """Whoever asks a session to move does it beside a fault ring."""
    beside_a_ring = {}
    for file, calls in _calls():
        # Path.home() takes nothing.
        moves = [c for c in calls if isinstance(c.func, ast.Attribute) and (c.args or c.keywords)]
        if {"stream", "jog", "home"} & {c.func.attr for c in moves if isinstance(c.func, ast.Attribute)}:
            names = {c.func.id for c in calls if isinstance(c.func, ast.Name)}
            beside_a_ring[file.name] = "FaultRing" in names
    assert beside_a_ring == {"streaming.py": True, "home.py": True}


def test_there_is_one_door_to_an_arm() -> None:
    """Sessions with an arm are opened by the door, and to acknowledge, which moves nothing."""
    named = {
        file.relative_to(Path(daq.__file__).parent).as_posix()
        for file, calls in _calls()
        if any(isinstance(call.func, ast.Name) and call.func.id == "ArmSession" for call in calls)
    }
    assert named == {"session/bench.py", "session/acknowledgement.py"}


def _calls() -> Iterator[tuple[Path, list[ast.Call]]]:
    for file in Path(daq.__file__).parent.rglob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        yield file, [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
