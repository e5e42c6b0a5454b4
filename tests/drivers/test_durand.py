"""Six nodes of an independent CANopen stack (durand) behind our master: boot-up, mapping, SYNC, PDO."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import can
import numpy as np
import pytest

from drivers import ArmSession, Channel, DriveError, Samples, open_bus
from robots import Robot

durand = pytest.importorskip("durand", reason="durand, an independent CANopen slave, is not installed")
from durand.datatypes import DatatypeEnum as Kind  # noqa: E402
from durand.network import NetworkABC  # noqa: E402
from durand.object_dictionary import Array, Record, Variable  # noqa: E402
from durand.scheduler import VirtualScheduler, set_scheduler  # noqa: E402

UP = {(0x40, 0x06): 0x21, (0x21, 0x07): 0x23, (0x23, 0x0F): 0x27, (0x27, 0x07): 0x23, (0x23, 0x06): 0x21}


class Wire(NetworkABC):  # type: ignore[misc]
    """What one node hears and says."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus = bus
        self.heard: dict[int, Callable[[int, bytes], None]] = {}

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        self.heard[cob_id] = callback

    def remove_subscription(self, cob_id: int, callback: object = None) -> None:
        self.heard.pop(cob_id, None)

    def send(self, cob_id: int, msg: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=cob_id, data=bytes(msg), is_extended_id=False))


class Axis:
    """A durand node with the few objects of CiA 402 that a master needs, and a heartbeat consumer."""

    def __init__(self, bus: can.BusABC, node_id: int, position: int) -> None:
        self.wire = Wire(bus)
        self.node = durand.MinimalNode(self.wire, node_id)
        self.due: float | None = None
        self.states: list[int] = []
        od = self.node.object_dictionary
        od[0x1016] = Array(Variable(Kind.UNSIGNED32, "rw", 0), length=1)
        plain: dict[int, tuple[Any, str, int]] = {
            0x6040: (Kind.UNSIGNED16, "rw", 0),
            0x6041: (Kind.UNSIGNED16, "ro", 0x40),
            0x6060: (Kind.INTEGER8, "rw", 0),
            0x6061: (Kind.INTEGER8, "ro", 0),
            0x6064: (Kind.INTEGER32, "ro", position),
            0x6077: (Kind.INTEGER16, "ro", 0),
            0x607A: (Kind.INTEGER32, "rw", position),
            0x6502: (Kind.UNSIGNED32, "ro", 0x80),
        }
        for index, (kind, access, value) in plain.items():
            od[index] = Variable(kind, access, value)
        period = Record()
        period[1] = Variable(Kind.UNSIGNED8, "rw", 1)
        period[2] = Variable(Kind.INTEGER8, "rw", -3)
        od[0x60C2] = period
        od.download_callbacks[(0x6060, 0)].add(lambda value: od.write(0x6061, 0, value))
        od.download_callbacks[(0x6040, 0)].add(self.obey)
        od.download_callbacks[(0x607A, 0)].add(self.move)

    def obey(self, controlword: int) -> None:
        od = self.node.object_dictionary
        state = od.read(0x6041, 0) & 0x6F
        state = 0x40 if not controlword & 2 else UP.get((state, controlword), state)
        if not self.states or self.states[-1] != state:
            self.states.append(state)
        od.write(0x6041, 0, state)

    def move(self, target: int) -> None:
        od = self.node.object_dictionary
        if od.read(0x6041, 0) & 0x6F == 0x27:
            od.write(0x6064, 0, target)
            od.write(0x6077, 0, self.node.node_id)

    def hear(self, cob_id: int, data: bytes) -> None:
        if cob_id == 0x77F and self.node.object_dictionary.read(0x1016, 1):
            milliseconds = self.node.object_dictionary.read(0x1016, 1) & 0xFFFF
            self.due = time.monotonic() + milliseconds / 1000
        if (callback := self.wire.heard.get(cob_id)) is not None:
            callback(cob_id, data)

    def watch(self) -> None:
        if self.due is not None and not self.node.object_dictionary.read(0x1016, 1):
            self.due = None
        if self.due is not None and time.monotonic() > self.due:
            self.due = None
            self.node.emcy.set(0x8130, 0)


def catch_up(scheduler: Any, duration: float) -> None:
    """Let the nodes' timers run, in steps shorter than any of their periods.

    Within one call of `run` durand counts what is entered again from the beginning of that call: a heartbeat
    whose period is shorter than the call would be due for ever.
    """
    for step in np.diff(np.append(np.arange(0.0, duration, 0.01), duration)):
        scheduler.run(float(step))


@contextmanager
def nodes(robot: Robot, channel: Channel) -> Iterator[list[Axis]]:
    """Six nodes in a thread, at the arm's home."""
    scheduler = VirtualScheduler()
    set_scheduler(scheduler)
    done = threading.Event()
    counts = np.rint(robot.transmission_matrix @ robot.home * robot.counts_per_output_unit).astype(int)
    with open_bus(channel) as bus:
        axes = [Axis(bus, d.node_id, int(p)) for d, p in zip(robot.drive, counts, strict=True)]

        def serve() -> None:
            before = time.monotonic()
            while not done.is_set():
                message = bus.recv(0.005)
                while message is not None:
                    for axis in axes:
                        axis.hear(message.arbitration_id, bytes(message.data))
                    message = bus.recv(0.0)
                now = time.monotonic()
                catch_up(scheduler, now - before)
                before = now
                # After all that waited was heard: a heartbeat in a held-up thread's queue is not missing.
                for axis in axes:
                    axis.watch()

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield axes
        finally:
            done.set()
            thread.join()


@pytest.fixture
def slow(tx40: Robot) -> Robot:
    """A cycle that six Python nodes in one thread can keep up with on a busy machine."""
    return tx40.model_copy(update={"bus": tx40.bus.model_copy(update={"cycle_time": 0.05})})


def test_six_nodes_of_another_stack_are_mapped_enabled_led_and_disabled(
    slow: Robot, new_channel: Callable[[], Channel]
) -> None:
    channel = new_channel()
    batches: list[Samples] = []
    with nodes(slow, channel) as axes, ArmSession(slow, channel) as session:
        assert [report.control_signal_bits for report in session.drives] == [16] * 6
        assert all(report.watches and report.heartbeat == 0.1 for report in session.drives)
        for axis in axes:
            od = axis.node.object_dictionary
            assert [od.read(0x1600, k) for k in (0, 1, 2)] == [2, 0x60400010, 0x607A0020]
            assert [od.read(0x1A00, k) for k in range(4)] == [3, 0x60410010, 0x60640020, 0x60770010]
            assert od.read(0x1800, 2) == od.read(0x1400, 2) == 1
            assert (od.read(0x60C2, 1), od.read(0x60C2, 2)) == (5, -2), "50 ms"
        t = np.linspace(0.0, 1.0, 60)
        start = session.actual_position()
        np.testing.assert_allclose(start, slow.home, atol=1e-4)
        reference = start + 0.02 * (64 * (t * (1 - t)) ** 3)[:, None]
        result = session.stream(reference, batches.append)
        samples = Samples.concatenate(batches)
        assert (result.outcome, result.cycles) == ("completed", 60), result.reason
        for axis in axes:
            assert axis.states == [0x40, 0x21, 0x23, 0x27, 0x23, 0x21, 0x40] or axis.states[0] == 0x21
            assert axis.states[-1] == 0x40 and 0x27 in axis.states
            assert axis.node.object_dictionary.read(0x1016, 1) == 0
    whole = samples.complete.all(axis=1)
    assert whole.sum() > 50
    # The node takes its RPDO and answers at the same SYNC: it is where the latest target is.
    assert np.abs(samples.position - samples.reference)[whole].max() < 0.005
    np.testing.assert_array_equal(
        np.rint(samples.control_signal[whole][-1] / slow.control_signal_per_count),
        [1, 2, 3, 4, 5, 6],
    )


def test_nodes_held_up_longer_than_their_heartbeat_catch_up() -> None:
    """As on a busy machine: the thread slept longer than a period, and `run` alone would not come back."""
    scheduler, beats = VirtualScheduler(), 0

    def beat() -> None:
        nonlocal beats
        beats += 1
        assert beats < 100, "due for ever"
        scheduler.add(0.1, beat)

    scheduler.add(0.1, beat)
    catch_up(scheduler, 0.55)
    assert beats in (5, 6), "each may come one step early"


def test_a_node_of_another_stack_that_notices_nothing_is_refused(
    slow: Robot, new_channel: Callable[[], Channel]
) -> None:
    channel = new_channel()
    with nodes(slow, channel) as axes:
        axes[1].watch = lambda: None  # type: ignore[method-assign]
        with pytest.raises(DriveError, match=r"joint_2 \(node 2\): 1016 is set, but a heartbeat"):
            ArmSession(slow, channel).open()
