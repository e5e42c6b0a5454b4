"""Events: what drives say in frames and statuswords, each change once and in words."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.recording.events import ERROR, FATAL, INFO, WARN, DriveEvent, EventFinder, first_fault
from daq.recording.frames import Frames
from robots import Robot
from tests.daq.captures import samples


def frame(cob_id: int, data: bytes, *, error: bool = False) -> Frames:
    frames = Frames.empty(1)
    frames.stamp[:] = 7
    frames.can_id[:] = cob_id
    frames.is_error[:] = error
    frames.dlc[:] = len(data)
    frames.data[0, : len(data)] = np.frombuffer(data, dtype=np.uint8)
    return frames


@pytest.mark.parametrize(
    ("cob_id", "data", "level", "kind", "text"),
    [
        (0x082, "1043080000000000", ERROR, "EMCY", "EMCY 0x4310 (motor over-temperature), error register"),
        (0x082, "0000000000000000", INFO, "EMCY", "error reset or no error"),
        (0x082, "11", WARN, "EMCY", "too short"),
        (0x702, "00", WARN, "NMT", "has booted"),
        (0x702, "7f", INFO, "NMT", "is pre-operational"),
        (0x702, "04", WARN, "NMT", "is stopped"),
        (0x702, "2a", INFO, "NMT", "is in NMT state 42"),
    ],
)
def test_a_frame_in_words(cob_id: int, data: str, level: int, kind: str, text: str, tx40: Robot) -> None:
    (event,) = EventFinder(tx40).in_frames(frame(cob_id, bytes.fromhex(data)))
    assert (event.stamp, event.level, event.joint, event.kind) == (7, level, "joint_2", kind)
    assert text in event.text


def test_the_bus_in_words(tx40: Robot) -> None:
    finder = EventFinder(tx40)
    (event,) = finder.in_frames(frame(0x040, bytes(8), error=True))
    assert (event.level, event.joint, event.text) == (
        FATAL,
        "bus",
        "the CAN controller went off the bus (bus-off)",
    )
    assert finder.in_frames(frame(0x002, bytes(8), error=True)) == []


def test_a_heartbeat_is_told_when_it_changes(tx40: Robot) -> None:
    finder = EventFinder(tx40)
    told = [len(finder.in_frames(frame(0x701, bytes([state])))) for state in (5, 5, 4, 4, 5, 0, 0)]
    assert told == [1, 0, 1, 0, 1, 1, 1]


def test_other_nodes_and_kinds_of_frames_are_no_events(tx40: Robot) -> None:
    finder = EventFinder(tx40)
    remote = frame(0x701, b"")
    remote.is_rtr[:] = True
    assert finder.in_frames(remote) == []
    for cob_id in (0x081 + 60, 0x700 + 60, 0x181, 0x201, 0x080):
        assert finder.in_frames(frame(cob_id, bytes(8))) == []


def test_power_states_are_told_when_they_change_across_batches(tx40: Robot) -> None:
    finder = EventFinder(tx40)
    first, second = samples(0, 10), samples(10, 10)
    second.statusword[4:, 3] = 0x0218
    stamps = np.arange(10, dtype=np.int64)
    begin = finder.in_samples(first, stamps)
    assert [(event.joint, event.level) for event in begin] == [(j.name, INFO) for j in tx40.joint]
    (event,) = finder.in_samples(second, stamps + 10)
    assert event == DriveEvent(14, ERROR, "joint_4", "state", 0x0218, "fault (cycle 14)")
    assert first_fault([*begin, event]) == event
    assert first_fault(begin) is None


TEXTS = st.text(st.characters(exclude_characters="\x00", exclude_categories=["Cs"]), max_size=20)


@given(
    st.builds(
        DriveEvent,
        st.integers(0, 2**31 * 10**9 - 1),
        st.integers(0, 255),
        TEXTS,
        TEXTS,
        st.integers(0, 2**32 - 1),
        TEXTS,
    )
)
def test_an_event_comes_back(event: DriveEvent) -> None:
    assert DriveEvent.decode(event.encode()) == event
