"""The set-up against simulated drives whose object dictionaries lack what real ones lack."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from drivers import ArmSession, BusError, Channel, DriveError, open_bus
from drivers.cia402 import State
from drivers.frames.period import interpolation_period
from drivers.session.jog import jog_path
from drivers.setup.attestation import refuse_unattested
from drivers.simulated.device import Device
from drivers.simulated.frame_sender import FrameSender
from drivers.simulated.group import DriveGroup
from drivers.simulated.object_dictionary import EDS_PATH
from drivers.simulated.process import serve
from drivers.simulated.truth import nominal_truth
from robots import Robot
from robots.description import ControlSignal, Identity, VelocityObject

Change = Callable[[DriveGroup], None]


@contextmanager
def drives(
    robot: Robot,
    channel: Channel,
    change: Change | None = None,
    devices: Sequence[Device] | None = None,
) -> Iterator[DriveGroup]:
    """Simulated drives in a thread of this process, on a virtual bus."""
    done = threading.Event()
    with open_bus(channel) as bus:
        sender = FrameSender(bus)
        group = DriveGroup(robot, nominal_truth(robot), sender, devices=devices)
        group.boot(time.monotonic())
        if change is not None:
            change(group)
        thread = threading.Thread(target=serve, args=(group, sender.port, lambda now: not done.is_set()))
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
            assert drive.process_data.rpdo.cob_id == 0x200 + drive.node_id
            assert drive.process_data.tpdo.cob_id == 0x180 + drive.node_id
            assert drive.process_data.tpdo.transmission_type == drive.process_data.rpdo.transmission_type == 1
            assert drive.process_data.rpdo.maps(0x6040) and drive.process_data.rpdo.maps(0x607A)
            assert all(drive.process_data.tpdo.maps(index) for index in (0x6041, 0x6064, 0x6077))
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
        (0x1600, r"node 2\): no RPDO can carry 6040:00 and 607A:00 alone \(1600: nothing\)"),
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


@pytest.mark.parametrize(
    ("word", "words"),
    [
        (0x4000_0080, "the drive sends SYNC by itself"),
        (0x81, "the drive waits for SYNC 0x081, the master sends 0x080"),
        (0x2000_0080, "the drive waits for SYNC 0x20000080"),
    ],
)
def test_a_drive_with_another_sync_is_refused(tx40: Robot, channel: Channel, word: int, words: str) -> None:
    def other(group: DriveGroup) -> None:
        group.drives[4].dictionary.set(0x1005, 0, word)

    with (
        drives(tx40, channel, other),
        pytest.raises(DriveError, match=rf"joint_5 \(node 5\): 1005: {words}"),
        ArmSession(tx40, channel),
    ):
        pass


def test_a_fault_is_refused_until_it_is_acknowledged(tx40: Robot, channel: Channel) -> None:
    with drives(tx40, channel) as group, ArmSession(tx40, channel) as session:
        group.drives[3].fail(0x4310)
        with pytest.raises(
            DriveError, match=r"joint_4 \(node 4\) is in state 'fault'; look at the arm, then"
        ):
            session._connection.refuse_faults()
        session.acknowledge_faults()
        session._connection.refuse_faults()


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


def drives_changed(robot: Robot, **changes: object) -> Robot:
    """The arm with other entries in every drive."""
    return robot.model_copy(update={"drive": tuple(d.model_copy(update=changes) for d in robot.drive)})


def test_each_drive_has_proved_that_it_notices_a_lost_master(tx40: Robot, channel: Channel) -> None:
    with drives(tx40, channel) as group, ArmSession(tx40, channel) as session:
        for drive in group.drives:
            assert drive.dictionary.integer(0x1003, 1) == 0x8130, "it has missed the master once"
            assert drive.dictionary.integer(0x1016, 1) == 0, "and watches nobody while nothing streams"
            assert drive.dictionary.integer(0x6007) == 1
            assert drive.dictionary.integer(0x1400, 5) == 100
        session._connection.arm()
        assert {drive.dictionary.integer(0x1016, 1) for drive in group.drives} == {127 << 16 | 100}


def test_a_drive_that_does_not_notice_is_refused(tx40: Robot, channel: Channel) -> None:
    def deaf(group: DriveGroup) -> None:
        group.drives[3].talk.heartbeats.hear = lambda node, now: None  # type: ignore[method-assign]

    with (
        drives(tx40, channel, deaf),
        pytest.raises(
            DriveError, match=r"joint_4 \(node 4\): 1016 is set, but a heartbeat .* was not noticed"
        ),
        ArmSession(tx40, channel),
    ):
        pass


def test_a_drive_that_cannot_watch_at_all_is_refused(tx40: Robot, channel: Channel) -> None:
    def blind(group: DriveGroup) -> None:
        entries = group.drives[2].dictionary._entries
        for key in [(0x1016, 0), (0x1016, 1), (0x1400, 5)]:
            del entries[key]

    with (
        drives(tx40, channel, blind),
        pytest.raises(
            DriveError,
            match=r"joint_3 \(node 3\): 1016: no heartbeat consumer \(absent\) and no RPDO deadline",
        ),
        ArmSession(tx40, channel),
    ):
        pass


def test_another_drive_than_described_is_refused(tx40: Robot, channel: Channel) -> None:
    ours = drives_changed(tx40, identity=Identity(vendor=0, product=0x402))
    with drives(tx40, channel), ArmSession(ours, channel) as session:
        assert not any("identity" in finding.subject for finding in session.drives[0].findings)

    def changed(group: DriveGroup) -> None:
        group.drives[4].dictionary.set(0x1018, 2, 0x999)

    with (
        drives(ours, channel, changed),
        pytest.raises(
            DriveError,
            match=r"node 5\): another drive than described: its product \(1018\) is 0x00000999, "
            r"identity.product is 0x00000402",
        ),
        ArmSession(ours, channel),
    ):
        pass


def test_a_drive_with_interpolated_position_alone_gets_its_set_points_in_60c1(
    tx40: Robot, channel: Channel
) -> None:
    def old(group: DriveGroup) -> None:
        for drive in group.drives:
            drive.dictionary.set(0x6502, 0, 1 << 6)

    with drives(tx40, channel, old) as group, ArmSession(tx40, channel) as session:
        assert {report.mode for report in session.drives} == {7}
        assert all(link.interpolated for link in session._connection.links())
        for drive in group.drives:
            assert drive.dictionary.integer(0x6061) == 7
            assert drive.process_data.rpdo.maps(0x60C1) and not drive.process_data.rpdo.maps(0x607A)


def test_a_wide_control_signal_has_a_tpdo_of_its_own(tx40: Robot, channel: Channel) -> None:
    wide = drives_changed(tx40, control_signal=ControlSignal(index=0x30D1, subindex=2, per_count=0.0005))
    with drives(wide, channel) as group, ArmSession(wide, channel) as session:
        assert {report.control_signal_bits for report in session.drives} == {32}
        for drive in group.drives:
            second = drive.process_data.second_tpdo
            assert second.cob_id == 0x280 + drive.node_id and second.valid
            assert second.maps(0x30D1) and not drive.process_data.tpdo.maps(0x30D1)
        assert session.bus_budget().bits_per_cycle == 55 + 6 * (115 + 115 + 95)


def test_a_velocity_that_is_to_be_recorded_has_the_second_tpdo(tx40: Robot, channel: Channel) -> None:
    fast = drives_changed(tx40, velocity=VelocityObject())
    with drives(fast, channel) as group, ArmSession(fast, channel) as session:
        assert {report.velocity_bits for report in session.drives} == {32}
        for drive in group.drives:
            second = drive.process_data.second_tpdo
            assert second.cob_id == 0x280 + drive.node_id and second.valid
            assert second.maps(0x606C) and drive.process_data.tpdo.maps(0x6077)
        assert session.bus_budget().bits_per_cycle == 55 + 6 * (115 + 135 + 95)
    full = fast.model_copy(update={"bus": fast.bus.model_copy(update={"bitrate": 500_000})})
    with drives(full, channel), pytest.raises(DriveError, match="loads a bus of 500 kbit/s"):
        ArmSession(full, channel).open()


def test_a_bus_that_would_be_too_full_is_refused(tx40: Robot, channel: Channel) -> None:
    full = tx40.model_copy(update={"bus": tx40.bus.model_copy(update={"bitrate": 250_000})})
    with drives(tx40, channel), pytest.raises(DriveError, match="loads a bus of 250 kbit/s"):
        ArmSession(full, channel).open()


def test_a_device_file_of_another_device_is_refused(tx40: Robot, channel: Channel) -> None:
    other = drives_changed(tx40, eds=str(Path(__file__).parent / "eds" / "epos4_like.eds"))
    message = r"identity: epos4_like.eds is of vendor 0x000000FB, the drive says 0x00000000 \(and 11 more\)"
    with drives(tx40, channel), pytest.raises(DriveError, match=message):
        ArmSession(other, channel).open()
    ours = drives_changed(tx40, eds=str(EDS_PATH))
    with drives(tx40, channel), ArmSession(ours, channel) as session:
        assert session.drives[0].notes == ()


def test_two_drives_on_one_id_are_refused(tx40: Robot, channel: Channel) -> None:
    def same(group: DriveGroup) -> None:
        group.drives[1].dictionary.set(0x1014, 0, 0x81)

    with (
        drives(tx40, channel, same),
        pytest.raises(DriveError, match=r"1014 holds COB-ID 0x081, as .*node 1"),
    ):
        ArmSession(tx40, channel).open()


def test_nothing_jogs_unless_it_was_allowed(tx40: Robot, channel: Channel) -> None:
    with (
        drives(tx40, channel),
        ArmSession(tx40, channel) as session,
        pytest.raises(DriveError, match="jogging is not allowed in this session"),
    ):
        session.jog("joint_2", 0.1)
    with drives(tx40, channel), ArmSession(tx40, channel, allow_jog=True) as session:
        with pytest.raises(DriveError, match="no joint 'elbow' to jog"):
            session.jog("elbow", 0.1)
        with pytest.raises(DriveError, match=r"jog at 0.5 of the limits; allowed: above 0, at most 0.1"):
            session.jog("joint_2", 0.1, share=0.5)
        with pytest.raises(DriveError, match=r"jog of joint joint_2 would end at 9; allowed: -2.18"):
            session.jog("joint_2", 9.0)
        with pytest.raises(BusError, match="lives inside one process"):
            session.jog("joint_2", 0.1)


@pytest.mark.parametrize("distance", [0.3, -0.02])
def test_a_jog_is_slow_and_moves_one_joint(tx40: Robot, distance: float) -> None:
    start = np.array(tx40.home)
    path = jog_path(tx40, start, "joint_3", distance, share=0.05)
    assert path[-1][2] == pytest.approx(start[2] + distance)
    np.testing.assert_array_equal(np.delete(path, 2, axis=1) - np.delete(start, 2), 0.0)
    speed = np.abs(np.diff(path[:, 2])).max() / tx40.bus.cycle_time
    assert speed <= 0.05 * tx40.joint[2].velocity * (1 + 1e-9)
    np.testing.assert_array_equal(path[0], start)


def test_a_position_that_was_lost_must_be_attested(tx40: Robot, channel: Channel) -> None:
    forgetful = drives_changed(tx40, position_reference="homing")
    with drives(tx40, channel), ArmSession(forgetful, channel) as session:
        with pytest.raises(DriveError, match=r"joint_1: its drive's position is lost with the supply"):
            refuse_unattested(forgetful, session._attested)
        with pytest.raises(DriveError, match=r"joint_2 stands at 0.2 but its drive says .*home the drive"):
            session.attest_position(np.array(tx40.home) + 0.2 * np.eye(6)[1])
        with pytest.raises(DriveError, match=r"posture has shape \(2,\); allowed: 6 numbers"):
            session.attest_position([0.0, 0.0])
        session.attest_position(tx40.home)
        refuse_unattested(forgetful, session._attested)
    refuse_unattested(tx40, attested=False)
