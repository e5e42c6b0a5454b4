"""The second socket: every frame of a bus, with the time of its arrival, and what was lost is counted."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import fields

import can
import numpy as np
import pytest
from can.interfaces.udp_multicast.utils import pack_message
from hypothesis import given
from hypothesis import strategies as st

from daq.recording import listener as module
from daq.recording.datagrams import SIZE, DatagramReader, Datagrams
from daq.recording.frame_decoding import MulticastDecoder, decode_socketcan
from daq.recording.frames import Frames
from daq.recording.listener import FrameListener
from drivers import BusError, Channel, open_bus

DECODER = MulticastDecoder()
MESSAGES = st.builds(
    lambda cob_id, data, stamp, extended, kind: can.Message(
        timestamp=stamp,
        arbitration_id=cob_id if not extended else cob_id << 12,
        is_extended_id=extended,
        is_error_frame=kind == "error",
        is_remote_frame=kind == "remote",
        data=b"" if kind == "remote" else data,
    ),
    st.integers(0, 0x7FF),
    st.binary(max_size=8),
    st.sampled_from([0.0, 1.5, 1.7e9, -1.0]),
    st.booleans(),
    st.sampled_from(["data", "data", "data", "error", "remote"]),
)


def datagrams(contents: list[bytes]) -> Datagrams:
    """As they come from a socket, with leftovers of earlier ones behind the last byte."""
    data = np.full((len(contents), SIZE), 0xC3, dtype=np.uint8)
    for row, content in enumerate(contents):
        data[row, : len(content)] = np.frombuffer(content, dtype=np.uint8)
    size = np.array([len(content) for content in contents], dtype=np.int64)
    return Datagrams(np.arange(len(contents), dtype=np.int64), size, data)


@given(st.lists(MESSAGES, max_size=12))
def test_datagrams_are_what_python_can_packed(sent: list[can.Message]) -> None:
    found = DECODER.decode(datagrams([bytes(pack_message(message)) for message in sent]))
    assert found.can_id.tolist() == [m.arbitration_id for m in sent]
    assert found.is_extended.tolist() == [m.is_extended_id for m in sent]
    assert found.is_error.tolist() == [m.is_error_frame for m in sent]
    assert found.is_rtr.tolist() == [m.is_remote_frame for m in sent]
    assert [row[:n].tobytes() for row, n in zip(found.data, found.dlc, strict=True)] == [
        bytes(m.data) for m in sent
    ]


@given(MESSAGES, st.data())
def test_a_changed_datagram_is_another_frame_or_none(message: can.Message, data: st.DataObject) -> None:
    content = bytearray(pack_message(message))
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    found = DECODER.decode(datagrams([bytes(content)]))
    assert len(found) <= 1
    assert (found.dlc <= 8).all()


@given(st.lists(st.binary(max_size=SIZE), max_size=8))
def test_other_datagrams_are_passed_over(contents: list[bytes]) -> None:
    assert len(DECODER.decode(datagrams(contents))) <= len(contents)
    assert len(decode_socketcan(datagrams(contents))) <= len(contents)


def test_socketcan_frames() -> None:
    raw = [
        bytes.fromhex("81010000 03000000 0102030405060708"),
        bytes.fromhex("05000080 08000000 0102030405060708"),
        bytes.fromhex("04000020 08000000 0030000000000000"),
        bytes(72),
    ]
    found = decode_socketcan(datagrams(raw))
    assert found.can_id.tolist() == [0x181, 5, 4]
    assert found.is_extended.tolist() == [False, True, False]
    assert found.is_error.tolist() == [False, False, True]
    assert found.data[0].tolist() == [1, 2, 3, 0, 0, 0, 0, 0]


@pytest.fixture
def heard(channel: Channel, monkeypatch: pytest.MonkeyPatch) -> Callable[[int], Frames]:
    """Hears what is sent on a bus; gives the frames once there are so many."""
    batches: list[Frames] = []
    listener = FrameListener(channel)
    listener.subscribe(batches.append)

    def wait(count: int) -> Frames:
        deadline = time.monotonic() + 10.0
        while sum(map(len, batches)) < count and time.monotonic() < deadline:
            time.sleep(0.01)
        listener.close()
        assert listener.failure is None
        assert listener.dropped == 0
        return Frames.concatenate(batches)

    return wait


def clock_offset() -> int:
    """Of the system's clock against the one that nobody sets, ns."""
    return time.time_ns() - time.monotonic_ns()


def test_every_frame_of_a_bus_is_heard_with_its_time(
    channel: Channel, heard: Callable[[int], Frames]
) -> None:
    generator = random.Random(1)
    sent = [
        can.Message(
            arbitration_id=generator.randrange(0x800),
            data=generator.randbytes(generator.randrange(9)),
            is_extended_id=False,
        )
        for _ in range(1500)
    ]
    offset, begin = clock_offset(), np.zeros(len(sent), dtype=np.int64)
    with open_bus(channel) as bus:
        for k, message in enumerate(sent):
            begin[k] = time.time_ns()
            bus.send(message)
    found = heard(len(sent))
    end = time.time_ns()  # the kernel of a busy machine takes a frame in, and stamps it, when it gets to it
    # The system's clock may be set meanwhile: kernel stamps of before are then of the clock of before.
    slack = 1_000_000 + abs(clock_offset() - offset)
    assert found.can_id.tolist() == [m.arbitration_id for m in sent]
    assert [row[:n].tobytes() for row, n in zip(found.data, found.dlc, strict=True)] == [
        bytes(m.data) for m in sent
    ]
    assert (np.diff(found.stamp) >= 0).all()
    assert (begin - slack <= found.stamp).all()
    assert found.stamp[-1] <= end + slack


def test_without_the_systems_batches_it_hears_the_same(
    channel: Channel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(DatagramReader, "read", DatagramReader._read_one_by_one)
    batches: list[Frames] = []
    with FrameListener(channel) as listener:
        listener.subscribe(batches.append)
        with open_bus(channel) as bus:
            for number in range(40):
                bus.send(can.Message(arbitration_id=number, data=bytes([number]), is_extended_id=False))
    assert Frames.concatenate(batches).can_id.tolist() == list(range(40))


def test_any_other_interface_is_heard_message_by_message() -> None:
    channel = Channel("virtual", "listener-test")
    batches: list[Frames] = []
    with FrameListener(channel) as listener, open_bus(channel) as bus:
        listener.subscribe(batches.append)
        bus.send(can.Message(arbitration_id=0x123, data=b"\x01\x02", is_extended_id=False))
        listener.fetch()
    (frames,) = batches
    assert (frames.can_id[0], frames.dlc[0], frames.data[0].tolist()) == (0x123, 2, [1, 2, 0, 0, 0, 0, 0, 0])
    assert frames.stamp[0] > 1_600_000_000 * 10**9


def test_frames_that_nobody_fetched_are_counted(channel: Channel, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FETCH_SECONDS", 3600.0)
    monkeypatch.setattr(module, "RECEIVE_BUFFER", 1 << 20)
    batches: list[Frames] = []
    many = 6_000
    with FrameListener(channel) as listener:
        listener.subscribe(batches.append)
        with open_bus(channel) as bus:
            message = can.Message(arbitration_id=0x181, data=bytes(8), is_extended_id=False)
            for _ in range(many):
                bus.send(message)
        listener.fetch()
        assert listener.dropped > 0
        assert listener.dropped + sum(map(len, batches)) == many


def test_an_unsubscribed_ear_hears_no_more(channel: Channel) -> None:
    batches: list[Frames] = []
    hear = batches.append
    with FrameListener(channel) as listener, open_bus(channel) as bus:
        listener.subscribe(hear)
        bus.send(can.Message(arbitration_id=1, is_extended_id=False))
        listener.unsubscribe(hear)
        bus.send(can.Message(arbitration_id=2, is_extended_id=False))
        listener.fetch()
    assert Frames.concatenate(batches).can_id.tolist() == [1]


def test_a_bus_that_cannot_be_opened_is_no_reason_not_to_run(caplog: pytest.LogCaptureFixture) -> None:
    absent = Channel("socketcan", "nocan99")
    with module.listening(absent) as listener:
        assert listener is None
    assert "raw frames are not recorded: cannot open socketcan:nocan99" in caplog.text
    with pytest.raises(BusError):
        FrameListener(absent)


@given(st.integers(0, 5))
def test_frames_become_messages_and_come_back(count: int) -> None:
    generator = np.random.default_rng(count)
    frames = Frames.empty(count)
    frames.stamp[:] = generator.integers(0, 2**31 * 10**9, count)
    frames.can_id[:] = generator.integers(0, 2**29, count)
    frames.is_error[:] = generator.integers(0, 2, count)
    frames.dlc[:] = 8
    frames.data[:] = generator.integers(0, 256, (count, 8))
    found = Frames.of_rows(frames.rows())
    assert found is not None
    for field in fields(Frames):
        assert np.array_equal(getattr(found, field.name), getattr(frames, field.name))
