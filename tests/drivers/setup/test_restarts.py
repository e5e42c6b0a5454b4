"""A drive that starts anew between two motions: it is refused, then configured and attested once more."""

from __future__ import annotations

import time
from collections.abc import Callable

import can
import pytest

from drivers import ArmSession, Channel, DriveError, StreamResult, open_bus
from drivers.setup.attestation import refuse_unattested
from robots import Robot
from tests.drivers.setup.test_setup import drives, drives_changed

RESET_NODE = 0x81


@pytest.fixture
def channel(request: pytest.FixtureRequest) -> Channel:
    return Channel("virtual", request.node.name)


def restart(channel: Channel, node: int) -> None:
    """As a short dip of the supply does it."""
    with open_bus(channel) as bus:
        bus.send(can.Message(arbitration_id=0, data=[RESET_NODE, node], is_extended_id=False))


def refusal(session: ArmSession) -> str:
    """Why a motion would be refused; empty where it would not be."""
    try:
        session._connection.refuse_restarted()
    except DriveError as error:
        return str(error)
    return ""


def test_a_boot_up_message_is_heard_and_the_drive_is_configured_once_more(
    tx40: Robot, channel: Channel
) -> None:
    forgetful = drives_changed(tx40, position_reference="homing")
    with drives(forgetful, channel) as group, ArmSession(forgetful, channel) as session:
        session.attest_position(session.actual_position())
        assert refusal(session) == ""
        # Its maker's own mapping: interpolation data where the master sends the target position.
        group.drives[2].delivery.changed_values[0x1600, 2] = 0x60C1_0120
        restart(channel, 3)
        deadline = time.monotonic() + 10.0
        while "joint_3 (node 3) has started anew since it was configured; look at the arm, then" not in (
            said := refusal(session)
        ):
            assert time.monotonic() < deadline, said
        del group.drives[2].delivery.changed_values[0x1600, 2]
        assert group.drives[2].dictionary.integer(0x1600, 2) == 0x60C1_0120
        session.acknowledge_faults()
        assert refusal(session) == ""
        assert group.drives[2].dictionary.integer(0x1600, 2) == 0x607A_0020
        with pytest.raises(DriveError, match="attest where the arm stands"):
            refuse_unattested(forgetful, session._attested)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ((0x1600, 2), 0x60C1_0120, "1600:02 reads 0x60C10120, 0x607A0020 was set"),
        ((0x1800, 2), 10, "1800:02 reads 0xA, 0x1 was set"),
        ((0x1400, 2), 255, "1400:02 reads 0xFF, 0x1 was set"),
        ((0x6061, 0), 3, "6061 reads 3, 8 was set"),
        ((0x60C2, 1), 8, "60C2:01 reads 0x8, 0x4 was set"),
        ((0x6007, 0), 0, "6007:00 reads 0x0, 0x1 was set"),
        ((0x1017, 0), 0, "1017:00 reads 0x0, 0x64 was set"),
    ],
)
def test_a_drive_whose_boot_up_nobody_heard_is_known_by_what_it_has_lost(
    tx40: Robot, channel: Channel, key: tuple[int, int], value: int, words: str
) -> None:
    with drives(tx40, channel) as group, ArmSession(tx40, channel) as session:
        group.drives[1].dictionary.set(*key, value)
        assert f"joint_2 (node 2) has lost its configuration ({words})" in refusal(session)
        session.acknowledge_faults()
        assert refusal(session) == ""
        assert session._attested is False


def test_what_the_cyclic_process_has_heard_counts(
    tx40: Robot, channel: Channel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def streamed(job: object, on_samples: Callable[..., None], control: object) -> StreamResult:
        return StreamResult("fault", "a drive", 0, 0, 0, restarted=("drive of joint joint_5 (node 5)",))

    monkeypatch.setattr("drivers.session.arm_session.run_stream", streamed)
    monkeypatch.setattr(ArmSession, "_refuse_stream", lambda session: None)
    with drives(tx40, channel), ArmSession(tx40, channel) as session:
        session.stream(session.actual_position()[None, :], lambda samples: None)
        assert "joint_5 (node 5) has started anew" in refusal(session)
        with pytest.raises(DriveError, match="has started anew"):
            session.stream(session.actual_position()[None, :], lambda samples: None)
