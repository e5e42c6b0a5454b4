"""The whole way: session, cyclic process, simulated arm in its process, over UDP on this machine."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import can
import numpy as np
import pytest

from drivers import ArmSession, BusError, Channel, DriveError, Samples, StreamResult, open_bus
from drivers.simulated import DeadAt, EmergencyAt, Faults, LostFrames, SimulatedArm
from robots import Robot

NewChannel = Callable[[], Channel]


def swing(robot: Robot, start: np.ndarray, seconds: float) -> np.ndarray:
    """Out and back from where the arm stands, every joint at 60 % of its acceleration limit at most."""
    t = np.linspace(0.0, 1.0, round(seconds / robot.bus.cycle_time))
    bell = 64 * (t * (1 - t)) ** 3
    peak = np.abs(np.diff(bell, 2)).max() / robot.bus.cycle_time**2
    size = np.minimum(0.6 * robot.acceleration_limits / peak, 0.2)
    return start + bell[:, None] * size


class Collector:
    """Keeps what a stream brings; may set an event, or fail, at a row."""

    def __init__(
        self, stop: threading.Event | None = None, at: int = 0, error: Exception | None = None
    ) -> None:
        self.batches: list[Samples] = []
        self.stop, self.at, self.error = stop, at, error

    def __call__(self, samples: Samples) -> None:
        self.batches.append(samples)
        if self.at and samples.cycle[-1] >= self.at:
            if self.error is not None:
                raise self.error
            if self.stop is not None:
                self.stop.set()

    @property
    def samples(self) -> Samples:
        return Samples.concatenate(self.batches)


def assert_controlled_end(robot: Robot, samples: Samples) -> None:
    """The record ends at rest, and no set-point ever asked for more than the acceleration limits."""
    period = robot.bus.cycle_time
    acceleration = np.diff(samples.reference, 2, axis=0) / period**2
    # Targets are whole counts; through the coupled wrist, two at a joint.
    count = 4 / np.abs(robot.counts_per_output_unit).min() / period**2
    assert np.all(np.abs(acceleration) <= robot.acceleration_limits * 1.001 + count)
    np.testing.assert_array_equal(samples.reference[-1], samples.reference[-2])


def statusword(channel: Channel, node: int) -> int:
    """6041h, read past everything else by a plain frame."""
    with open_bus(channel, [0x580 + node]) as bus:
        request = bytes([0x40, 0x41, 0x60, 0, 0, 0, 0, 0])
        bus.send(can.Message(arbitration_id=0x600 + node, data=request, is_extended_id=False))
        answer = bus.recv(5.0)
    assert answer is not None
    return int.from_bytes(answer.data[4:6], "little")


def stream(
    robot: Robot,
    channel: Channel,
    seconds: float,
    collector: Collector,
    stop: threading.Event | None = None,
) -> StreamResult:
    with ArmSession(robot, channel) as session:
        return session.stream(swing(robot, session.actual_position(), seconds), collector, stop)


def test_a_whole_stream_and_a_second_one(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    with SimulatedArm("tx40", channel, seed=3), ArmSession(tx40, channel) as session:
        assert {report.vendor for report in session.drives} == {0}
        for _ in range(2):
            start = session.actual_position()
            reference = swing(tx40, start, 1.2)
            collector = Collector()
            result = session.stream(reference, collector)
            assert (result.outcome, result.cycles) == ("completed", 300)
            samples = collector.samples
            assert samples.cycle.tolist() == list(range(300))
            np.testing.assert_allclose(samples.time, np.arange(300) * 0.004)
            np.testing.assert_allclose(samples.reference, reference, atol=1e-4)
            row = samples.complete.all(axis=1)
            assert np.count_nonzero(~row) == result.incomplete_cycles <= 3
            assert np.abs(samples.position - samples.reference)[row].max() < 0.05
            assert np.all(samples.control_signal[row].std(axis=0) > 0.01)
            assert set(samples.statusword[row].ravel() & 0x6F) == {0x27}
            assert len(collector.batches) >= 5
        assert np.abs(session.actual_position() - tx40.home).max() < 0.02
        assert statusword(channel, 1) & 0x4F == 0x40


def test_a_stop_is_a_ramp_and_the_record_goes_on_to_its_end(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    stop = threading.Event()
    with SimulatedArm("tx40", channel):
        collector = Collector(stop, at=100)
        result = stream(tx40, channel, 6.0, collector, stop)
        assert (result.outcome, result.reason) == ("stopped", "stop requested")
        assert 100 < result.cycles < 1000
        assert_controlled_end(tx40, collector.samples)
        assert [statusword(channel, node) & 0x4F for node in range(1, 7)] == [0x40] * 6


def test_an_emergency_in_motion_stops_all_axes_and_is_explained(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    faults = Faults(emergencies=(EmergencyAt(node=4, cycle=220, code=0x4310),))
    with SimulatedArm("tx40", channel, faults=faults):
        collector = Collector()
        result = stream(tx40, channel, 6.0, collector)
        assert result.outcome == "fault"
        assert result.reason.startswith("drive of joint joint_4 (node 4) left operation enabled")
        assert "EMCY 0x4310 (motor over-temperature)" in result.reason
        assert_controlled_end(tx40, collector.samples)
        with ArmSession(tx40, channel) as session:
            start = session.actual_position()
            with pytest.raises(
                DriveError,
                match=r"joint_4 \(node 4\) is in state 'fault'; look at the arm, then `armhil acknowledge",
            ):
                session.stream(swing(tx40, start, 1.0), Collector())
            session.acknowledge_faults()
            assert session.stream(swing(tx40, start, 0.5), Collector()).outcome == "completed"


def test_a_drive_that_dies_in_motion_is_named(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    with SimulatedArm("tx40", channel, faults=Faults(dead=(DeadAt(node=2, cycle=220),))):
        collector = Collector()
        result = stream(tx40, channel, 6.0, collector)
        assert (result.outcome, result.incomplete_cycles > 0) == ("aborted", True)
        assert result.reason.startswith("no TPDO from drive of joint joint_2 (node 2)")
        assert_controlled_end(tx40, collector.samples)
        assert not collector.samples.complete[-1, 1]
        assert statusword(channel, 1) & 0x4F == 0x40


def test_lost_answers_are_marked_in_their_rows(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    faults = Faults(lost_tpdos=(LostFrames(node=5, cycle=200, cycles=2),))
    with SimulatedArm("tx40", channel, faults=faults):
        collector = Collector()
        result = stream(tx40, channel, 1.2, collector)
        assert result.outcome == "completed"
        missing = np.flatnonzero(~collector.samples.complete[:, 4])
        assert len(missing) >= 2


def test_an_exception_of_the_receiver_stops_the_arm_first(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    with SimulatedArm("tx40", channel):
        with pytest.raises(OSError, match="disk full"):
            stream(tx40, channel, 6.0, Collector(at=50, error=OSError("disk full")))
        assert [statusword(channel, node) & 0x4F for node in range(1, 7)] == [0x40] * 6


def test_refusals_before_anything_is_enabled(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    with SimulatedArm("tx40", channel), ArmSession(tx40, channel) as session:
        start = session.actual_position()
        with pytest.raises(DriveError, match=r"joint_3 stands at .* but the reference begins at"):
            session.stream(swing(tx40, start + 0.1 * np.eye(6)[2], 1.0), Collector())
        fast = start + 4 * (swing(tx40, start, 0.4) - start)
        with pytest.raises(DriveError, match=r"leaves its (velocity|acceleration) limit at cycle"):
            session.stream(fast, Collector())


def test_a_master_that_is_at_work_already_is_heard(tx40: Robot, new_channel: NewChannel) -> None:
    channel = new_channel()
    done = threading.Event()

    def other_master() -> None:
        with open_bus(channel, []) as bus:
            while not done.wait(0.01):
                bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))

    thread = threading.Thread(target=other_master)
    thread.start()
    try:
        with pytest.raises(BusError, match=r"occupied: another master is on it, heard 0x080 \(SYNC\)"):
            ArmSession(tx40, channel).open()
    finally:
        done.set()
        thread.join()


def test_an_empty_bus_is_one_clear_line(tx40: Robot, new_channel: NewChannel) -> None:
    with pytest.raises(DriveError, match=r"drive of joint joint_1 \(node 1\): reading 6041:00: no answer"):
        ArmSession(tx40, new_channel()).open()


MASTER = """
import sys, numpy as np, robots
from drivers import ArmSession, Channel
robot = robots.load("tx40")
with ArmSession(robot, Channel.parse(sys.argv[1])) as session:
    start = session.actual_position()
    t = np.linspace(0.0, 1.0, 5000)
    path = start + 0.2 * (64 * (t * (1 - t)) ** 3)[:, None] * np.ones(6)
    result = session.stream(path, lambda samples: print(samples.cycle[-1], flush=True))
    print(result.outcome, result.reason, flush=True)
"""


@pytest.fixture
def master(new_channel: NewChannel) -> tuple[Channel, Callable[[], subprocess.Popen[str]]]:
    """A script with a session of its own, as a process that can be killed."""
    channel = new_channel()

    def start() -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-c", MASTER, str(channel)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        while int(process.stdout.readline() or "9999") < 50:
            pass
        return process

    return channel, start


def cyclic_processes(parent: int) -> list[int]:
    """Processes whose parent is, or was, the given one."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = stat.read_bytes()
            status = (stat.parent / "status").read_text()
        except OSError:
            continue
        if b"drivers.cyclic" in line and f"PPid:\t{parent}\n" in status:
            found.append(int(stat.parent.name))
    return found


def gone(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return True
    return b"drivers.cyclic" not in Path(f"/proc/{process}/cmdline").read_bytes()


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks processes up in /proc")
def test_ctrl_c_ramps_down_and_leaves_nothing_behind(
    master: tuple[Channel, Callable[[], subprocess.Popen[str]]],
) -> None:
    channel, start = master
    with SimulatedArm("tx40", channel), start() as process:
        (cyclic,) = cyclic_processes(process.pid)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=60)
        assert output.splitlines()[-1] == "stopped Ctrl-C"
        assert process.returncode == 0
        assert gone(cyclic)
        assert [statusword(channel, node) & 0x4F for node in range(1, 7)] == [0x40] * 6


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks processes up in /proc")
def test_a_killed_parent_leaves_an_arm_that_stands_and_no_process(
    master: tuple[Channel, Callable[[], subprocess.Popen[str]]],
) -> None:
    channel, start = master
    with SimulatedArm("tx40", channel), start() as process:
        (cyclic,) = cyclic_processes(process.pid)
        process.kill()
        process.communicate(timeout=60)
        deadline = time.monotonic() + 60
        while not gone(cyclic) and time.monotonic() < deadline:
            time.sleep(0.02)
        assert gone(cyclic)
        assert [statusword(channel, node) & 0x4F for node in range(1, 7)] == [0x40] * 6


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks processes up in /proc")
def test_a_killed_cyclic_process_leaves_the_stop_to_the_drives(
    master: tuple[Channel, Callable[[], subprocess.Popen[str]]],
) -> None:
    channel, start = master
    with SimulatedArm("tx40", channel), start() as process:
        (cyclic,) = cyclic_processes(process.pid)
        os.kill(cyclic, signal.SIGKILL)
        output, _ = process.communicate(timeout=60)
        assert "aborted the cyclic process ended without a result (exit code -9)" in output
        deadline = time.monotonic() + 5
        states = [0] * 6
        # The drives notice by themselves that SYNC stays away, ramp down, and end in fault.
        while states != [0x08] * 6 and time.monotonic() < deadline:
            states = [statusword(channel, node) & 0x4F for node in range(1, 7)]
        assert states == [0x08] * 6
