"""The set-up against simulated drives whose object dictionaries lack what real ones lack."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from drivers import ArmSession, BusError, Channel, DriveError, open_bus
from drivers.cia402 import State
from drivers.setup import interpolation_period
from drivers.simulated.group import DriveGroup
from drivers.simulated.process import frame_sender, serve
from drivers.simulated.truth import nominal_truth
from robots import Robot

Change = Callable[[DriveGroup], None]


@contextmanager
def drives(robot: Robot, channel: Channel, change: Change | None = None) -> Iterator[DriveGroup]:
    """Simulated drives in a thread of this process, on a virtual bus."""
    done = threading.Event()
    with open_bus(channel) as bus:
        group = DriveGroup(robot, nominal_truth(robot), frame_sender(bus))
        group.boot(time.monotonic())
        if change is not None:
            change(group)
        thread = threading.Thread(target=serve, args=(group, bus, lambda now: not done.is_set()))
        thread.start()
        try:
            yield group
        finally:
            done.set()
            thread.join()


@pytest.fixture
def channel(request: pytest.FixtureRequest) -> Channel:
    return Channel("virtual", request.node.name)


def remove(axis: int, *indices: int) -> Change:
    """Take objects out of one drive's dictionary."""

    def change(group: DriveGroup) -> None:
        entries = group.drives[axis].dictionary._entries
        for key in [key for key in entries if key[0] in indices]:
            del entries[key]

    return change


def test_a_session_configures_every_drive_and_leaves_torque_off(tx40: Robot, channel: Channel) -> None:
    with drives(tx40, channel) as group, ArmSession(tx40, channel) as session:
        assert [report.node_id for report in session.drives] == [1, 2, 3, 4, 5, 6]
        assert {report.state for report in session.drives} == {State.SWITCH_ON_DISABLED}
        assert {report.control_signal_bits for report in session.drives} == {16}
        for drive in group.drives:
            assert drive.rpdo.cob_id == 0x200 + drive.node_id
            assert drive.tpdo.cob_id == 0x180 + drive.node_id
            assert drive.tpdo.transmission_type == drive.rpdo.transmission_type == 1
            assert drive.rpdo.maps(0x6040) and drive.rpdo.maps(0x607A)
            assert all(drive.tpdo.maps(index) for index in (0x6041, 0x6064, 0x6077))
            assert drive.period == tx40.bus.cycle_time
            assert drive.dictionary.integer(0x6061) == 8
        assert abs(session.actual_position() - tx40.home).max() < 1e-4


def test_a_drive_that_is_not_there_is_named(tx40: Robot, channel: Channel) -> None:
    absent = tx40.drive[2].model_copy(update={"node_id": 99})
    wrong = tx40.model_copy(update={"drive": (*tx40.drive[:2], absent, *tx40.drive[3:])})
    message = r"drive of joint joint_3 \(node 99\): reading 6041:00: no answer within 1 s"
    with drives(tx40, channel), pytest.raises(DriveError, match=message), ArmSession(wrong, channel):
        pass


def test_optional_objects_may_be_absent_and_are_reported(tx40: Robot, channel: Channel) -> None:
    change = remove(1, 0x6502, 0x1017, 0x6007, 0x605A)
    with drives(tx40, channel, change), ArmSession(tx40, channel) as session:
        report = session.drives[1]
        assert report.supported_modes is None
        assert report.settings["605A"] is None
        assert report.settings["6065"] is not None
        assert len(report.notes) == 2 and "6502" in report.notes[0] and "1017" in report.notes[1]
        assert session.drives[0].notes == ()


@pytest.mark.parametrize(
    ("lacking", "message"),
    [
        (
            0x60C2,
            r"node 2\): writing 0x4 to 60C2:01: the drive refuses: the (object|subindex) does not exist",
        ),
        (0x6077, r"node 2\): reading 6077:00: the drive refuses: the (object|subindex) does not exist"),
        (0x1600, r"node 2\): writing 0x0 to 1600:00: the drive refuses"),
    ],
)
def test_a_drive_without_a_needed_object_is_refused(
    tx40: Robot, channel: Channel, lacking: int, message: str
) -> None:
    with (
        drives(tx40, channel, remove(1, lacking)),
        pytest.raises(DriveError, match=message),
        ArmSession(tx40, channel),
    ):
        pass


def test_a_drive_without_csp_is_refused(tx40: Robot, channel: Channel) -> None:
    def no_csp(group: DriveGroup) -> None:
        group.drives[0].dictionary.set(0x6502, 0, 0x3F)

    with (
        drives(tx40, channel, no_csp),
        pytest.raises(DriveError, match="6502 = 0x0000003F has neither cyclic synchronous position mode"),
        ArmSession(tx40, channel),
    ):
        pass


def test_a_mode_that_does_not_show_is_refused(tx40: Robot, channel: Channel) -> None:
    def deaf(group: DriveGroup) -> None:
        dictionary = group.drives[5].dictionary
        dictionary.listeners[0x6060] = lambda subindex, value: None
        dictionary.set(0x6061, 0, -1)

    with (
        drives(tx40, channel, deaf),
        pytest.raises(DriveError, match=r"node 6\): mode 8 \(csp\) was set but 6061 shows -1"),
        ArmSession(tx40, channel),
    ):
        pass


def test_a_fault_is_refused_until_it_is_acknowledged(tx40: Robot, channel: Channel) -> None:
    with drives(tx40, channel) as group, ArmSession(tx40, channel) as session:
        group.drives[3].fail(0x4310)
        with pytest.raises(DriveError, match=r"joint_4 \(node 4\) is in state 'fault'; acknowledge it"):
            session._refuse_faults()
        session.acknowledge_faults()
        session._refuse_faults()


def test_a_stream_needs_a_bus_between_processes(tx40: Robot, channel: Channel) -> None:
    with (
        drives(tx40, channel),
        ArmSession(tx40, channel) as session,
        pytest.raises(BusError, match="lives inside one process"),
    ):
        session.stream([tx40.home], lambda samples: None)


def test_a_second_master_is_refused(tx40: Robot, channel: Channel) -> None:
    with (
        drives(tx40, channel),
        ArmSession(tx40, channel),
        pytest.raises(BusError, match="another armhil run holds it as master"),
        ArmSession(tx40, channel),
    ):
        pass


def test_a_closed_session_does_nothing(tx40: Robot, channel: Channel) -> None:
    with pytest.raises(DriveError, match="the session is not open"):
        ArmSession(tx40, channel).actual_position()


@pytest.mark.parametrize(
    ("seconds", "pair"),
    [
        (0.004, (4, -3)),
        (0.0025, (25, -4)),
        (0.000125, (125, -6)),
        (0.01, (1, -2)),
        (0.3, (3, -1)),
        (2.0, (2, 0)),
    ],
)
def test_interpolation_period(seconds: float, pair: tuple[int, int]) -> None:
    assert interpolation_period(seconds) == pair


@pytest.mark.parametrize("seconds", [1 / 300, 0.0012345, 1e-7])
def test_a_period_without_exact_form_is_refused(seconds: float) -> None:
    with pytest.raises(DriveError, match="cannot be written as interpolation period"):
        interpolation_period(seconds)
