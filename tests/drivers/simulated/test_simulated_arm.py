"""The simulated arm as a process on a bus: start, errors, a run, and an end without traces."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable

import can
import canopen
import numpy as np
import pytest

from drivers import BusError, Channel, DriveError, listen_for_traffic, open_bus
from drivers.simulated import PlantTruth, SimulatedArm, draw_truth, simulate_offline
from drivers.simulated.object_dictionary import EDS_PATH
from robots import Robot


def gone(pid: int) -> bool:
    """Whether a process has ended within 5 s."""
    for _ in range(250):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.02)
    return False


def test_it_boots_says_its_truth_and_leaves_nothing(tx40: Robot, new_channel: Callable[[], Channel]) -> None:
    channel = new_channel()
    with SimulatedArm("tx40", channel, seed=4) as arm:
        assert arm.running
        assert arm.truth() == draw_truth(tx40, 4)
        assert {0x700 + node for node in range(1, 7)} <= listen_for_traffic(channel, 0.4)
        pid = arm.pid
    assert gone(pid)
    assert listen_for_traffic(channel, 0.15) == frozenset()
    arm.close()
    assert not arm.running


def test_an_occupied_bus_is_refused_in_one_line(new_channel: Callable[[], Channel]) -> None:
    channel = new_channel()
    with SimulatedArm("emps", channel), pytest.raises(BusError) as refusal:
        SimulatedArm("emps", channel)
    assert str(channel) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_frames_of_somebody_else_occupy_a_bus(new_channel: Callable[[], Channel]) -> None:
    channel = new_channel()
    with open_bus(channel) as bus:
        message = can.Message(arbitration_id=0x705, is_extended_id=False, data=b"\x05")
        done = threading.Event()

        def talk() -> None:
            while not done.wait(0.02):
                bus.send(message)

        thread = threading.Thread(target=talk)
        thread.start()
        try:
            with pytest.raises(BusError, match="0x705"):
                SimulatedArm("emps", channel)
        finally:
            done.set()
            thread.join()


def test_an_unknown_arm_is_refused_in_one_line(new_channel: Callable[[], Channel]) -> None:
    with pytest.raises(DriveError, match="nonesuch") as refusal:
        SimulatedArm("nonesuch", new_channel())
    assert "\n" not in str(refusal.value)


def test_a_truth_of_ones_own_is_simulated(tx40: Robot, new_channel: Callable[[], Channel]) -> None:
    own = draw_truth(tx40, 99)
    with SimulatedArm("tx40", new_channel(), truth=own) as arm:
        assert arm.truth() == own


def test_it_ends_when_its_parent_is_killed(new_channel: Callable[[], Channel]) -> None:
    program = (
        "import sys, time; from drivers import Channel; from drivers.simulated import SimulatedArm\n"
        "arm = SimulatedArm('emps', Channel('udp_multicast', sys.argv[1]))\n"
        "print(arm.pid, flush=True); time.sleep(60)"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", program, new_channel().name], stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    parent.stdout.close()
    assert gone(pid)


def test_it_ignores_sigint_and_obeys_sigterm(new_channel: Callable[[], Channel]) -> None:
    channel = new_channel()
    with SimulatedArm("emps", channel) as arm:
        os.kill(arm.pid, signal.SIGINT)
        assert listen_for_traffic(channel, 0.3)
        assert arm.running
        os.kill(arm.pid, signal.SIGTERM)
        for _ in range(250):
            if not arm.running:
                break
            time.sleep(0.02)
        assert not arm.running


def exchange(bus: can.BusABC, controlword: int, targets: np.ndarray) -> np.ndarray:
    """One cycle of a plain master: RPDOs, SYNC, and a row (statusword, position, signal) per node."""
    for node, target in enumerate(targets, start=1):
        data = struct.pack("<Hi", controlword, int(target))
        bus.send(can.Message(arbitration_id=0x200 + node, data=data, is_extended_id=False))
    bus.send(can.Message(arbitration_id=0x080, is_extended_id=False))
    rows = {}
    while len(rows) < len(targets):
        message = bus.recv(5.0)
        assert message is not None
        rows[message.arbitration_id - 0x180] = struct.unpack("<Hih", message.data)
    return np.array([rows[node + 1] for node in range(len(targets))])


def test_a_run_over_the_bus_equals_the_run_without(
    tx40: Robot, truth: PlantTruth, new_channel: Callable[[], Channel]
) -> None:
    time_ = np.arange(120) * tx40.bus.cycle_time
    reference = np.array(tx40.home) + 0.1 * np.outer(1 - np.cos(4 * np.pi * time_), np.ones(6))
    scale = tx40.counts_per_output_unit
    targets = np.rint(reference @ tx40.transmission_matrix.T * scale)
    channel = new_channel()
    with (
        SimulatedArm("tx40", channel, truth=truth),
        open_bus(channel, range(0x181, 0x187)) as bus,
    ):
        bus.send(can.Message(arbitration_id=0x000, data=b"\x01\x00", is_extended_id=False))
        for word in (0x06, 0x07):
            exchange(bus, word, targets[0])
        rows = np.array([exchange(bus, 0x0F, target) for target in targets])
    assert (rows[:, :, 0] & 0x6F == 0x27).all()
    run = simulate_offline(tx40, truth, reference)
    to_joint = np.linalg.inv(tx40.transmission_matrix).T
    assert np.array_equal((rows[:, :, 1] / scale) @ to_joint, run.position)
    assert np.array_equal(rows[:, :, 2] * tx40.control_signal_per_count, run.control_signal)


def test_the_canopen_profile_of_an_independent_library_drives_a_node(
    new_channel: Callable[[], Channel],
) -> None:
    channel = new_channel()
    with SimulatedArm("emps", channel):
        network = canopen.Network(open_bus(channel))
        network.NOTIFIER_CYCLE = 0.02
        network.connect()
        try:
            node = canopen.BaseNode402(1, str(EDS_PATH))
            network.add_node(node)
            node.nmt.state = "OPERATIONAL"
            node.nmt.wait_for_heartbeat(timeout=5)
            network.sync.start(0.001)
            node.tpdo[1].read()
            node.rpdo[1].read()
            assert [v.index for v in node.tpdo[1].map] == [0x6041, 0x6064, 0x6077]
            assert node.sdo[0x6061].raw == 8
            wanted = [0x21, 0x23, 0x27, 0x40]
            # The library sends SYNC from a thread of Python. Where the machine stalls it for 50 ms the drive
            # goes to fault, as it should; then the walk begins anew.
            for _ in range(10):
                states = [walk(node, word) for word in (0x06, 0x07, 0x0F, 0x00)]
                if 0x08 not in states:
                    break
                walk(node, 0x80)
            assert states == wanted
            network.sync.stop()
        finally:
            network.disconnect()


def walk(node: canopen.BaseNode402, controlword: int) -> int:
    """Gives a command by SDO; returns the state bits of the statusword afterwards."""
    node.sdo[0x6040].raw = controlword
    return int(node.sdo[0x6041].raw) & 0x6F
