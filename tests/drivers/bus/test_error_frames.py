"""What the CAN controller says of itself, in words and in a stream; frames that found no room."""

from __future__ import annotations

import socket
from collections.abc import Callable

import can
import pytest

from drivers import Channel, open_bus
from drivers.bus.error_frames import ERROR_FLAG, error_report
from drivers.bus.multicast import LocalMulticastBus
from drivers.bus.ports import frame_port
from drivers.cia402.states import State
from tests.drivers.cyclic.test_loop import all_off, run
from tests.drivers.fake_arm import FakeArm


@pytest.mark.parametrize(
    ("kind", "controller", "words", "fatal", "lost"),
    [
        (0x040, 0x00, "bus-off", True, False),
        (0x100, 0x00, "restarted after bus-off", True, False),
        (0x004, 0x10, "error-passive", True, False),
        (0x004, 0x20, "error-passive", True, False),
        (0x004, 0x04, "error-warning", False, False),
        (0x004, 0x08, "error-warning", False, False),
        (0x004, 0x01, "frames were lost", False, True),
        (0x004, 0x02, "frames were lost", False, True),
        (0x001, 0x00, "could not send a frame in time", False, False),
        (0x020, 0x00, "no other node acknowledges", False, False),
    ],
)
def test_a_report_in_words(kind: int, controller: int, words: str, fatal: bool, lost: bool) -> None:
    report = error_report(ERROR_FLAG | kind, bytes([0, controller, 0, 0, 0, 0, 0, 0]))
    assert report is not None
    assert words in report.text
    assert (report.fatal, report.lost) == (fatal, lost)


def test_single_bit_errors_and_short_reports_are_passed_over() -> None:
    assert error_report(0x008, bytes([0, 0, 1, 0, 0, 0, 0, 0])) is None
    assert error_report(0x004, b"") is None
    assert error_report(0x004, bytes(8)) is None


def report(arm: FakeArm, kind: int, controller: int = 0) -> None:
    """An error frame that the master's controller hands up."""
    arm.put(kind, bytes([0, controller, 0, 0, 0, 0, 0, 0]))
    arm._queue[0][1].is_error_frame = True


@pytest.mark.parametrize(
    ("kind", "controller", "words"), [(0x004, 0x10, "is error-passive"), (0x040, 0, "(bus-off)")]
)
def test_a_bus_that_cannot_be_relied_on_stops_the_arm_and_is_not_resumed(
    kind: int, controller: int, words: str
) -> None:
    def fail(number: int, arm: FakeArm) -> None:
        if number == 200:
            report(arm, kind, controller)

    done = run(fail)
    assert done.result.outcome == "aborted" and words in done.result.reason
    assert all_off(done.arm) and max(done.largest_acceleration(axis) for axis in range(3)) <= 1.0
    assert done.result.cycles < 400
    words_sent = done.arm.axes[0].controlwords
    after = words_sent[words_sent.index(0x00) :]
    assert set(after) == {0x00}, "nothing leads up again"


def test_a_warning_is_told_and_the_stream_goes_on() -> None:
    def warn(number: int, arm: FakeArm) -> None:
        if number in (200, 201):
            report(arm, 0x004, 0x04)

    done = run(warn)
    assert done.result.outcome == "completed"
    assert done.result.notes == ("the CAN controller counts many errors (error-warning) (2 times)",)
    assert all(axis.state is State.SWITCH_ON_DISABLED for axis in done.arm.axes)


def test_frames_that_found_no_room_are_counted(new_channel: Callable[[], Channel]) -> None:
    channel = new_channel()
    sent = 3000
    with open_bus(channel) as bus, open_bus(channel) as other:
        assert isinstance(bus, LocalMulticastBus)
        port = frame_port(bus)
        receiver = bus.sockets[0]
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        assert port.overflows() == 0
        message = can.Message(arbitration_id=0x181, data=bytes(8), is_extended_id=False)
        for _ in range(sent):
            other.send(message)
        port.wait(1.0)
        received = len(port.drain())
        assert 0 < received < sent
        assert port.overflows() == sent - received


def message(cob_id: int, data: bytes, **flags: bool) -> can.Message:
    return can.Message(arbitration_id=cob_id, data=data, is_extended_id=False, **flags)  # type: ignore[arg-type]


class Adapter(can.BusABC):
    """Hands over what it is given."""

    def __init__(self, *messages: can.Message) -> None:
        self.waiting = list(messages)
        super().__init__("adapter")

    def recv(self, timeout: float | None = None) -> can.Message | None:
        return self.waiting.pop(0) if self.waiting else None

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise AssertionError("nothing is sent here")


class PcanAdapter(Adapter):
    """One whose error frames are PCAN-Basic's."""


PcanAdapter.__module__ = "can.interfaces.pcan.pcan"


def test_own_frames_that_come_back_are_no_second_master() -> None:
    with Adapter(message(0x080, b"", is_rx=False), message(0x181, bytes(8))) as bus:
        assert frame_port(bus).drain() == [(0x181, bytes(8))]


@pytest.mark.parametrize(
    ("kind", "data", "words"),
    [
        (4, [0, 0x1C, 0, 8], None),  # one stuff error at "overload flag": Linux would read error-passive
        (0, [0, 0, 97, 0], "error-warning"),
        (8, [1, 0x19, 0, 128], "error-passive"),
        (64, [0, 0, 0, 0], None),
    ],
)
def test_error_frames_of_pcan_are_read_as_pcan_has_them(
    kind: int, data: list[int], words: str | None
) -> None:
    with PcanAdapter(message(kind, bytes(data), is_error_frame=True)) as bus:
        ((can_id, payload),) = frame_port(bus).drain()
        told = error_report(can_id, payload)
    assert told is None if words is None else told is not None and words in told.text
