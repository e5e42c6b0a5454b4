"""A zero that moved while the drives were off: noticed at the next opening, until somebody has looked."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robots
from drivers import ArmSession, Channel, DriveError, StreamResult
from drivers.simulated.group import DriveGroup
from tests.drivers.setup.test_setup import drives

GOOD = StreamResult("completed", "the whole reference was streamed", 1, 0, 0)
HOME_OFFSET = 0x607C


@pytest.fixture(autouse=True)
def real_bus(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm counts as a real one, and its streams end as a test says."""
    monkeypatch.setattr(Channel, "only_simulated", False)
    monkeypatch.setattr(ArmSession, "_refuse_stream", lambda session: session._refuse_unacknowledged())


def drive_once(
    monkeypatch: pytest.MonkeyPatch,
    channel: Channel,
    change: Callable[[DriveGroup], None] | None = None,
    result: StreamResult = GOOD,
    *,
    attest: bool = False,
    acknowledge: bool = False,
) -> None:
    """Power on drives that something has happened to, and stream."""
    robot = robots.load("emps")
    monkeypatch.setattr("drivers.session.arm_session.run_stream", lambda *a: result)
    with drives(robot, channel, change), ArmSession(robot, channel) as session:
        if acknowledge:
            session.acknowledge_faults()
        if attest:
            session.attest_position(session.actual_position())
        session.stream(session.actual_position()[None, :], lambda samples: None)


def shifted_offset(group: DriveGroup) -> None:
    group.drives[0].dictionary.set(HOME_OFFSET, 0, 4321)


def moved_by(distance: float) -> Callable[[DriveGroup], None]:
    def change(group: DriveGroup) -> None:
        robot = robots.load("emps")
        group.bench.stand(np.array(robot.home) + distance)
        group._show_position()

    return change


def test_what_has_not_changed_is_not_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    channel = Channel("virtual", "same")
    for _ in range(3):
        drive_once(monkeypatch, channel)
    drive_once(monkeypatch, channel, moved_by(0.01))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (shifted_offset, r"home offset \(607C\) of the drive of carriage is 4321; it was 0 at .* UTC"),
        (moved_by(0.05), r"joint carriage reads 0\.\d+, and came to rest at 0 at .* UTC"),
        (moved_by(-0.05), r"joint carriage reads -0\.\d+, and came to rest at"),
    ],
)
def test_a_zero_that_moved_while_the_drives_were_off_asks_for_attestation(
    monkeypatch: pytest.MonkeyPatch, change: Callable[[DriveGroup], None], words: str
) -> None:
    channel = Channel("virtual", "moved")
    drive_once(monkeypatch, channel)
    for _ in range(2):
        with pytest.raises(DriveError, match=rf"{words}.*attest that \(`armhil home`, or --stands-at\)"):
            drive_once(monkeypatch, channel, change)
    drive_once(monkeypatch, channel, change, attest=True)
    drive_once(monkeypatch, channel, change)
    with pytest.raises(DriveError, match="attest"):
        drive_once(monkeypatch, channel)


def test_another_user_on_another_bus_is_asked_as_well(
    monkeypatch: pytest.MonkeyPatch, own_state: Path
) -> None:
    drive_once(monkeypatch, Channel("virtual", "here"))
    assert [path.name[:5] for path in own_state.glob("rest-*")] == ["rest-"]
    with pytest.raises(DriveError, match="607C"):
        drive_once(monkeypatch, Channel("virtual", "there"), shifted_offset)


def test_where_a_motion_was_cut_off_the_position_is_not_known_but_the_offset_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    channel = Channel("virtual", "cut")
    drive_once(monkeypatch, channel)
    drive_once(monkeypatch, channel, result=replace(GOOD, outcome="aborted"))
    with pytest.raises(DriveError, match="607C"):
        drive_once(monkeypatch, channel, shifted_offset, acknowledge=True)
    drive_once(monkeypatch, channel, moved_by(0.05), acknowledge=True)


@pytest.mark.parametrize("text", ["{", "[1]", '{"when": "", "offsets": [0], "position": ["x"]}', "7"])
def test_a_damaged_record_asks_too(monkeypatch: pytest.MonkeyPatch, own_state: Path, text: str) -> None:
    channel = Channel("virtual", "damaged")
    drive_once(monkeypatch, channel)
    (record,) = own_state.glob("rest-*")
    assert json.loads(record.read_text())["offsets"] == [0]
    record.write_text(text)
    with pytest.raises(DriveError, match="the record of where it last stood is damaged"):
        drive_once(monkeypatch, channel)
    record.unlink()
    os.mkfifo(record)
    with pytest.raises(DriveError, match="cannot be read"):
        drive_once(monkeypatch, channel)


def test_simulated_drives_have_no_record(monkeypatch: pytest.MonkeyPatch, own_state: Path) -> None:
    monkeypatch.setattr(Channel, "only_simulated", True)
    drive_once(monkeypatch, Channel("virtual", "simulated"))
    drive_once(monkeypatch, Channel("virtual", "simulated"), shifted_offset)
    assert not list(own_state.glob("rest-*"))
