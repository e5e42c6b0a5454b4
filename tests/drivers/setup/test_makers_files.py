"""Makers' files as drives: served over SDO by another library, set up, and foretold by the doctor.

Each configures, or names the one thing to change. The files are no part of the clone (``$ARMHIL_DATA``).
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from drivers import ArmSession, Channel, DriveError
from drivers.setup.eds import read_device_file
from drivers.setup.foresee import foresee
from robots import Robot
from robots.description import ControlSignal
from tests.drivers.file_slave import FileSlave, file_slaves
from tests.drivers.setup.test_foresee import without
from tests.drivers.setup.test_setup import drives_changed

DATA = Path(os.environ.get("ARMHIL_DATA", Path(__file__).parents[4] / "shared" / "data")) / "eds"
NODES = (1, 2, 3, 4, 5, 6)
KNOWS_ITS_ENCODER = {
    "x608Fsub1_DefaultValue": "196608",
    "x6091sub1_DefaultValue": "32",
    "x6092sub1_DefaultValue": "6291456",
}
TECHNOSOFT_TORQUE = ControlSignal(index=0x2022, subindex=0, per_count=0.001)
NO_WATCH = (
    r"1016: no heartbeat consumer \(absent\) and no RPDO deadline \(1400:05\).*needs a firmware with one"
)


@dataclass(frozen=True)
class Case:
    """A file, what robot.toml says of its drives, and what is refused: nothing where it configures."""

    name: str
    refused: str = ""
    drive: dict[str, Any] = field(default_factory=dict)
    profile: str = "cia402"
    mode: int = 8


COUNTS = {"counts_per_output_turn": 6291456.0}
CASES = [
    Case("maxon_epos4.dcf", profile="maxon_epos4"),
    Case("schunk_lwa4d.dcf", mode=7),
    Case("schunk_lwa4d.dcf", drive={"profile": "schunk_lwa4d"}, profile="schunk_lwa4d", mode=7),
    Case("elmo_gold_whistle.dcf", "608F: is 1/1 as delivered: .*write counts_per_output_turn"),
    Case("elmo_gold_whistle.dcf", drive=COUNTS, profile="elmo_gold"),
    Case("danfoss_isd860.dcf", r"6077.*; write control_signal with index = 0x2022, subindex = 0"),
    Case("danfoss_isd860.dcf", NO_WATCH, drive={"control_signal": TECHNOSOFT_TORQUE}),
]


def opened(robot: Robot, path: Path, channel: str, change: Any = None) -> tuple[str, int]:
    """Profile and mode of the first drive after an opening of six nodes of one file."""
    with file_slaves(path, NODES, interface="virtual", channel=channel) as slaves:
        for slave in slaves if change else ():
            change(slave)
        with ArmSession(robot, Channel("virtual", channel)) as session:
            session.bus_budget().check()
            return session.drives[0].profile.name, session.drives[0].mode


def a_consumer_as_the_standard_has_it(slave: FileSlave) -> None:
    """The Gold's file allows 65535 in 1016:01, where the node id stands in bits 16 to 22."""
    if slave.node.object_dictionary[0x1018][1].value == 0x9A:
        slave.node.object_dictionary[0x1016][1].max = None


@pytest.mark.parametrize(
    "case", CASES, ids=lambda case: f"{case.name}-{'refused' if case.refused else 'fine'}"
)
def test_a_makers_drive_configures_or_names_the_one_thing(
    tx40: Robot, case: Case, request: pytest.FixtureRequest
) -> None:
    path = DATA / case.name
    if not path.is_file():
        pytest.skip(f"no {path}")
    arm = drives_changed(tx40, **case.drive)
    found = foresee(arm, 0, read_device_file(path, 1))
    told = [f"{finding.subject}: {finding.text}" for finding in found if finding.severity == "refusal"]
    if not case.refused:
        assert told == []
        done = opened(arm, path, request.node.name, a_consumer_as_the_standard_has_it)
        assert done == (case.profile, case.mode)
        return
    with pytest.raises(DriveError, match=case.refused):
        opened(arm, path, request.node.name, a_consumer_as_the_standard_has_it)
    remedy = case.refused.rpartition("write ")[2]
    assert any(re.search(remedy, words) for words in told), told


def test_a_consumer_without_room_for_a_node_id_is_found_out(tx40: Robot, tmp_path: Path) -> None:
    """As the file of the Gold has it: the doctor doubts the file, the opening asks the drive."""
    path = without(tmp_path, "1400sub5", x1016sub1_HighLimit="65535", **KNOWS_ITS_ENCODER)
    found = foresee(tx40, 0, read_device_file(path, 1))
    doubts = [finding for finding in found if finding.subject == "1016"]
    assert [doubt.severity for doubt in doubts] == ["warning"] and "HighLimit 65535" in doubts[0].text
    arm = drives_changed(tx40, encoder_counts=196608, gear=32.0)
    message = r"no heartbeat consumer \(writing 0x7F0064 to 1016:01: the drive refuses: value too high"
    with pytest.raises(DriveError, match=message):
        opened(arm, path, "limited consumer")


def test_a_file_of_our_own_configures_on_a_server_of_others(tx40: Robot, tmp_path: Path) -> None:
    path = without(tmp_path, **KNOWS_ITS_ENCODER)
    arm = drives_changed(tx40, encoder_counts=196608, gear=32.0)
    assert opened(arm, path, "own file") == ("cia402", 8)


def test_a_heartbeat_time_that_cannot_be_written_is_used(tx40: Robot, tmp_path: Path) -> None:
    values = {"x1017_AccessType": "ro", "x1017_DefaultValue": "50"}
    path = without(tmp_path, **KNOWS_ITS_ENCODER, **values)
    arm = drives_changed(tx40, encoder_counts=196608, gear=32.0)
    text = "1017: cannot be written: its own 50 ms between heartbeats are used"
    assert text in [str(finding) for finding in foresee(arm, 0, read_device_file(path, 1))]
    with (
        file_slaves(path, NODES, interface="virtual", channel="own heartbeat"),
        ArmSession(arm, Channel("virtual", "own heartbeat")) as session,
    ):
        assert {drive.heartbeat for drive in session.drives} == {0.05}
        assert text in [str(finding) for finding in session.drives[0].findings]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"x60C2sub1_AccessType": "ro", "x60C2sub1_DefaultValue": "2"},
            "writing 0x4 to 60C2:01: the drive refuses: the object cannot be written",
        ),
        ({"x6064_PDOMapping": "0"}, "no TPDO has room for 6064:00"),
        ({"x6502_DefaultValue": "0x3F"}, "has neither cyclic synchronous position mode"),
        ({"x1005_DefaultValue": "0x40000080"}, "the drive sends SYNC by itself"),
    ],
)
def test_what_the_doctor_foretells_a_server_of_others_says(
    tx40: Robot, tmp_path: Path, values: dict[str, str], message: str
) -> None:
    path = without(tmp_path, **KNOWS_ITS_ENCODER, **values)
    arm = drives_changed(tx40, encoder_counts=196608, gear=32.0)
    found = foresee(arm, 0, read_device_file(path, 1))
    assert any(message in f"{finding}" for finding in found if finding.severity == "refusal"), found
    with pytest.raises(DriveError, match=message):
        opened(arm, path, f"told {next(iter(values))}")
