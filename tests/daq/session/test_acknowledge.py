"""armhil acknowledge: what stands is shown and asked for, then faults and the note of the last motion go."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

import robots
from daq.cli import entry as cli
from daq.recording.capture import CaptureError
from daq.session.acknowledgement import acknowledge
from daq.session.session_error import NotMoved
from drivers import ArmSession, Channel, DriveError, Outcome, StreamResult
from drivers.bus.lockout import Lockout
from drivers.cyclic.stream import BusNotOpened
from tests.drivers.setup.test_setup import drives


@pytest.fixture
def folder(own_state: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bus of real drives, as far as the note is concerned, in a folder of its own."""
    monkeypatch.setattr(Channel, "only_simulated", False)
    return own_state


def test_a_note_outlives_the_session_and_keeps_the_next_one_from_moving(folder: Path) -> None:
    robot, channel = robots.load("emps"), Channel("virtual", "noted")
    Lockout(channel).keep("following error of drive 1 is 1234 counts")
    with drives(robot, channel):
        with ArmSession(robot, channel) as session:
            assert session.unacknowledged == "following error of drive 1 is 1234 counts"
        asked: list[tuple[str, ...]] = []
        with pytest.raises(NotMoved, match="not acknowledged"):
            acknowledge(robot, channel, lambda standing: bool(asked.append(standing)))
        assert asked == [("the last motion did not end well: following error of drive 1 is 1234 counts",)]
        assert acknowledge(robot, channel, lambda standing: True)
        assert not acknowledge(robot, channel, lambda standing: False), "nothing stands any more"
        with ArmSession(robot, channel) as session:
            assert session.unacknowledged is None
    assert list(folder.glob("lockout-*")) == []


@pytest.mark.parametrize(("outcome", "noted"), [("aborted", True), ("fault", True), ("stopped", False)])
def test_a_stream_that_ends_by_itself_leaves_the_note(
    folder: Path, monkeypatch: pytest.MonkeyPatch, outcome: Outcome, noted: bool
) -> None:
    robot, channel = robots.load("emps"), Channel("virtual", outcome)

    def streamed(job: object, on_samples: object, control: object) -> StreamResult:
        (found,) = folder.glob("lockout-*")
        assert "was cut off" in str(ArmSession(robot, channel).unacknowledged), "noted before anything moves"
        assert found.stat().st_mode & 0o777 == folder.stat().st_mode & 0o666, "as its folder"
        return StreamResult(outcome, "no TPDO from drive 1", 0, 0, 0)

    with drives(robot, channel), monkeypatch.context() as patch, ArmSession(robot, channel) as session:
        patch.setattr("drivers.session.arm_session.run_stream", streamed)
        patch.setattr(ArmSession, "_refuse_stream", lambda session: None)
        session.stream(session.actual_position()[None, :], lambda samples: None)
    later = ArmSession(robot, channel)
    assert later.unacknowledged == ("no TPDO from drive 1" if noted else None)
    if noted:
        with pytest.raises(
            DriveError, match=r"by itself \(no TPDO from drive 1\); look at .* `armhil acknowledge emps"
        ):
            later._refuse_unacknowledged()


@pytest.mark.parametrize(
    ("end", "stands"),
    [
        (BusNotOpened("cannot open"), None),
        (CaptureError("disk full"), "the program that drove it failed: disk full"),
        (KeyboardInterrupt(), "the program that drove it failed: KeyboardInterrupt"),
        (StreamResult("completed", "", 1, 0, 0, torque_unconfirmed=("drive 1",)), "NOT KNOWN to be without"),
        (StreamResult("stopped", "", 1, 0, 0, rest_unconfirmed=("drive 1",)), "NOT KNOWN to be at rest"),
        (StreamResult("completed", "", 1, 0, 0), None),
    ],
)
def test_only_a_good_end_takes_the_note_away(
    folder: Path, monkeypatch: pytest.MonkeyPatch, end: BaseException | StreamResult, stands: str | None
) -> None:
    def streamed(job: object, on_samples: object, control: object) -> StreamResult:
        if isinstance(end, BaseException):
            raise end
        return end

    robot, channel = robots.load("emps"), Channel("virtual", "ends")
    with drives(robot, channel), monkeypatch.context() as patch, ArmSession(robot, channel) as session:
        patch.setattr("drivers.session.arm_session.run_stream", streamed)
        patch.setattr(ArmSession, "_refuse_stream", lambda session: None)
        with suppress(BusNotOpened, CaptureError, KeyboardInterrupt):
            session.stream(session.actual_position()[None, :], lambda samples: None)
    found = ArmSession(robot, channel).unacknowledged
    assert found is None if stands is None else found is not None and stands in found


def test_simulated_drives_leave_no_note(own_state: Path) -> None:
    for text in ("udp_multicast:239.74.1.1", "virtual:here", "socketcan:vcan0", "socketcan:vxcan1"):
        Lockout(Channel.parse(text)).keep("anything")
        assert Lockout(Channel.parse(text)).reason is None
    Lockout(Channel.parse("socketcan:can0")).keep("anything")
    assert Lockout(Channel.parse("socketcan:can0")).reason == "anything"
    assert Lockout(Channel.parse("socketcan:can1")).reason is None
    assert [path.name for path in own_state.iterdir()] == ["lockout-socketcan-can0.json"]


def test_the_command_resets_a_fault(
    new_channel: Callable[[], Channel], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, channel = robots.load("emps"), new_channel()
    command = ["armhil", "acknowledge", "emps", "--channel", channel.name]

    def call(*options: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", [*command, *options])
        with pytest.raises(SystemExit) as exit_:
            cli.main()
        said = capsys.readouterr()
        return int(exit_.value.code or 0), said.out + said.err

    with drives(robot, channel) as group:
        group.drives[0].fail(0x4310)
        code, said = call()
        assert code == 2 and "give --yes where nobody can answer" in said
        assert "is in state 'fault'" in said and "0x4310" in said
        assert group.drives[0].machine.state.name == "FAULT"
        code, said = call()
        assert code == 2 and "0x4310" in said, "what stopped it, not the heartbeat that it missed since"
        code, said = call("--yes")
        assert code == 0 and "Acknowledged; no drive is in fault." in said
        assert group.drives[0].machine.state.name == "SWITCH_ON_DISABLED"
        assert call() == (0, "Nothing stands to be acknowledged.\n")
