"""Fault capture: the seconds before and after a fault, as a capture of their own."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from daq.recording.capture import CaptureError, Gap
from daq.recording.events import ERROR
from daq.recording.fault_ring import FaultRing
from daq.recording.frames import Frames
from daq.recording.listener import FrameListener
from daq.recording.reader import read_capture, read_frames
from drivers import ArmSession, Channel, StreamResult
from drivers.simulated import SimulatedArm
from drivers.simulated.faults import EmergencyAt, Faults
from robots import Robot
from tests.daq.captures import facts, samples, traffic


def wait_for(condition: Callable[[], object], seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def uneventful(robot: Robot, cycles: int) -> Frames:
    """Traffic of now without an emergency in it."""
    frames = traffic(robot, cycles, time.time_ns() - cycles * 1_000_000)
    wrong = frames.is_error | ((frames.can_id > 0x080) & (frames.can_id < 0x100))
    return frames.select(~wrong)


def test_nothing_is_written_where_nothing_happens(tmp_path: Path, tx40: Robot) -> None:
    with FaultRing(tmp_path / "faults", tx40, facts(tx40)) as ring:
        ring.write(samples(0, 500))
        ring.write_frames(uneventful(tx40, 50))
        ring.ended(StreamResult("completed", "", 500, 0, 0))
        ring.ended(StreamResult("stopped", "Ctrl-C", 500, 0, 0))
    assert not (tmp_path / "faults").exists()


def test_a_drive_in_fault_is_kept_with_what_came_before_and_after(tmp_path: Path, tx40: Robot) -> None:
    with FaultRing(tmp_path, tx40, facts(tx40), before=0.5, after=0.3) as ring:
        for begin in range(0, 3000, 50):
            batch = samples(begin, 50)
            if begin >= 2000:
                batch.statusword[:, 3] = 0x0218
            ring.write(batch)
            time.sleep(0.0005)
        ring.write(samples(3000, 50))
        wait_for(lambda: ring.captures)
    (path,) = ring.captures
    capture = read_capture(path)
    # The synthetic cycles came faster than their clock: the fault is at 2 s of it, and 0.5 s came before.
    cycles = capture.samples.cycle
    assert cycles[0] <= 1500 < cycles[0] + 100
    assert cycles[-1] == 3049
    expected = samples(0, 3050)
    assert np.array_equal(capture.samples.position, expected.position[cycles])
    assert not capture.damage
    assert capture.records["armhil.fault"]["reason"] == "joint_4: fault (cycle 2000)"
    assert capture.outcome is not None
    assert capture.outcome["outcome"] == "fault"
    assert any(e.level == ERROR and e.joint == "joint_4" for e in capture.events)


def test_faults_that_follow_belong_to_the_first_and_later_ones_get_their_own(
    tmp_path: Path, tx40: Robot
) -> None:
    with FaultRing(tmp_path, tx40, facts(tx40), after=0.1) as ring:
        ring.write_frames(uneventful(tx40, 20))
        ring.trigger("first")
        ring.trigger("a consequence")
        wait_for(lambda: len(ring.captures) == 1)
        ring.trigger("second")
    reasons = [
        read_capture(path, allow_empty=True).records["armhil.fault"]["reason"] for path in ring.captures
    ]
    assert reasons == ["first", "second"]


def test_only_the_last_seconds_are_kept_in_memory(tmp_path: Path, tx40: Robot) -> None:
    begin = time.time_ns()
    with FaultRing(tmp_path, tx40, facts(tx40), before=1.0) as ring:
        for second in range(20):
            ring.write(samples(second * 1000, 1000))
            frames = uneventful(tx40, 1000)
            frames.stamp[:] = begin + second * 10**9 + np.arange(len(frames)) * 1000
            ring.write_frames(frames)
        assert len(ring._samples) <= 3
        assert len(ring._frames) <= 3


def test_two_streams_in_one_capture_have_a_gap_between_them(tmp_path: Path, tx40: Robot) -> None:
    with FaultRing(tmp_path, tx40, facts(tx40), after=0.0) as ring:
        ring.write(samples(0, 40))
        time.sleep(0.3)
        ring.write(samples(0, 40))
        ring.ended(StreamResult("fault", "joint_2: its drive left operation enabled", 40, 0, 0))
    capture = read_capture(ring.captures[0])
    assert len(capture.samples) == 80
    (gap,) = capture.damage.gaps
    assert gap.first == 40
    assert 100 <= gap.cycles <= 2000
    assert isinstance(gap, Gap)
    assert [len(piece) for piece in capture.segments()] == [40, 40]


def test_an_idle_arm_has_frames_and_no_samples(tmp_path: Path, tx40: Robot) -> None:
    with FaultRing(tmp_path, tx40, facts(tx40), after=0.0) as ring:
        ring.write_frames(traffic(tx40, 30, time.time_ns()))
    (path,) = ring.captures
    capture = read_capture(path, allow_empty=True)
    assert len(capture.samples) == 0
    assert capture.frames == len(traffic(tx40, 30))
    assert capture.damage.lost_frames == 0
    assert "EMCY 0x4310" in capture.records["armhil.fault"]["reason"]
    with pytest.raises(CaptureError, match="no sample in it can be read"):
        read_capture(path)


def test_a_folder_that_cannot_be_written_ends_nothing(
    tmp_path: Path, tx40: Robot, caplog: pytest.LogCaptureFixture
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    with FaultRing(blocked / "faults", tx40, facts(tx40), after=0.0) as ring:
        ring.trigger("test")
    assert ring.captures == []
    assert "cannot be kept" in caplog.text


def test_an_emergency_while_jogging_the_simulated_arm(
    tx40: Robot, channel: Channel, tmp_path: Path, no_leftovers: None
) -> None:
    node = tx40.drive[1].node_id
    faults = Faults(emergencies=(EmergencyAt(node, 150, 0x8611),))
    with (
        SimulatedArm("tx40", channel, 1, faults=faults),
        ArmSession(tx40, channel, allow_jog=True) as session,
        FrameListener(channel) as listener,
        FaultRing(tmp_path, tx40, facts(tx40, tx40.bus.cycle_time), listener, after=0.5) as ring,
    ):
        result = session.jog("joint_2", 0.05, ring.write)
        ring.ended(result)
    assert result.outcome == "fault"
    (path,) = ring.captures
    capture, frames = read_capture(path), read_frames(path)
    assert "joint_2" in capture.records["armhil.fault"]["reason"]
    emergencies = [e for e in capture.events if e.kind == "EMCY" and e.level == ERROR]
    assert {(e.joint, e.code) for e in emergencies} == {("joint_2", 0x8611)}
    # Before the emergency the arm moved, after it came to rest and its drives were disabled.
    position = capture.samples.position[:, 1]
    assert np.abs(position - position[0]).max() > 1e-4
    syncs = frames.stamp[frames.can_id == 0x080]
    assert syncs[0] < emergencies[0].stamp < syncs[-1]
    sent = frames.select(frames.can_id == 0x080 + node)
    assert 0x8611 in {int.from_bytes(row[:2].tobytes(), "little") for row in sent.data}
