"""What the doctor says of a device file is what the opening of such a drive says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from drivers import ArmSession, Channel, DriveError
from drivers.setup.eds import read_device_file
from drivers.setup.foresee import foresee
from drivers.simulated.device import described_devices
from drivers.simulated.object_dictionary import EDS_PATH
from drivers.simulated.quirks import Quirks
from robots import Robot
from robots.description import ControlSignal
from tests.drivers.setup.test_setup import drives, drives_changed

HERE = Path(__file__).parent / "eds"


def without(folder: Path, *sections: str, **values: str) -> Path:
    """The simulated drive's own EDS without sections, and with other values: ``x608Fsub1_DefaultValue``."""
    text = EDS_PATH.read_text("utf-8")
    for section in sections:
        text = re.sub(rf"(?ms)^\[{section}(sub[0-9A-F]+)?\]\n.*?(?=^\[|\Z)", "", text)
    for name, value in values.items():
        section, key = name.removeprefix("x").split("_")
        text, count = re.subn(rf"(?ms)(^\[{section}\]\n[^\[]*?^{key}=)[^\n]*", rf"\g<1>{value}", text)
        assert count == 1, name
    path = folder / "drive.eds"
    path.write_text(text, "utf-8")
    return path


def refusals(robot: Robot, path: Path) -> dict[str, str]:
    found = foresee(robot, 0, read_device_file(path, 1))
    return {finding.subject: finding.text for finding in found if finding.severity == "refusal"}


@pytest.fixture
def encoder(tmp_path: Path) -> Path:
    """A file that knows the encoder and the gear of the first drive."""
    return without(
        tmp_path,
        x608Fsub1_DefaultValue="196608",
        x6091sub1_DefaultValue="32",
        x6092sub1_DefaultValue="6291456",
    )


def test_a_file_that_suits_is_not_refused(tx40: Robot, encoder: Path) -> None:
    assert refusals(tx40, encoder) == {}


@pytest.mark.parametrize(
    ("sections", "values", "subject", "words"),
    [
        (["6077"], {}, "6077", "write control_signal with another object of the drive"),
        (["60C2"], {}, "60C2", "writing 0x4 to 60C2:01: the drive refuses: the object does not exist"),
        (["1600"], {}, "PDO", "no RPDO can carry 6040:00 and 607A:00 alone"),
        (["1016", "1400sub5"], {}, "1016", "node guarding, 100C, is not spoken here"),
        ([], {"x1005_DefaultValue": "0x40000080"}, "1005", "the drive sends SYNC by itself"),
        ([], {"x6502_DefaultValue": "0x3F"}, "6502", "has neither cyclic synchronous position mode"),
        ([], {"x6064_PDOMapping": "0"}, "PDO", "no TPDO has room for 6064:00"),
        (
            [],
            {"x60C2sub1_AccessType": "ro", "x60C2sub1_DefaultValue": "2"},
            "60C2",
            "set it in the drive, or bus.cycle_time to 0.002 s",
        ),
        ([], {"x60C2sub1_HighLimit": "3", "x60C2sub1_DefaultValue": "2"}, "60C2", "value too high"),
        (
            [],
            {"x1800sub2_AccessType": "ro", "x1800sub2_DefaultValue": "255"},
            "PDO",
            "writing 0x1 to 1800:02: the drive refuses: the object cannot be written (SDO abort 0x06010002); "
            "it holds 255: set 1800:02 to 1 in the drive",
        ),
        (
            [],
            {"x6060_AccessType": "ro", "x6060_DefaultValue": "1", "x6061_DefaultValue": "1"},
            "mode",
            "writing 0x8 to 6060:00: the drive refuses: the object cannot be written",
        ),
        (
            [],
            {"x60C2sub1_AccessType": "ro", "x60C2sub1_DefaultValue": "4"}
            | {"x60C2sub2_AccessType": "ro", "x60C2sub2_DefaultValue": "-2"},
            "60C2",
            "writing 0x4",
        ),
        ([], {"x608Fsub1_DefaultValue": "65536"}, "608F", "the drive counts 65536 per motor revolution"),
    ],
)
def test_each_obstacle_is_foreseen(
    tx40: Robot,
    tmp_path: Path,
    sections: list[str],
    values: dict[str, str],
    subject: str,
    words: str,
) -> None:
    known = {
        "x608Fsub1_DefaultValue": "196608",
        "x6091sub1_DefaultValue": "32",
        "x6092sub1_DefaultValue": "6291456",
    }
    found = refusals(tx40, without(tmp_path, *sections, **(known | values)))
    assert list(found) == [subject] and words in found[subject], found


def test_a_sync_period_of_its_own_is_told(tx40: Robot, tmp_path: Path) -> None:
    path = without(tmp_path, x1006_DefaultValue="10000")
    (found,) = [f for f in foresee(tx40, 0, read_device_file(path, 1)) if f.subject == "1006"]
    assert found.severity == "warning" and "every 10000 µs, bus.cycle_time is 4000 µs" in found.text
    path = without(tmp_path, x1006_DefaultValue="4000")
    assert not [f for f in foresee(tx40, 0, read_device_file(path, 1)) if f.subject == "1006"]


def test_limits_of_a_file_are_compared_with_the_description(tx40: Robot, tmp_path: Path) -> None:
    values = {
        "x607Dsub1_DefaultValue": "-1000",
        "x607Dsub2_DefaultValue": "1000",
        "x6080_DefaultValue": "100",
        "x6065_DefaultValue": "500",
        "x6072_DefaultValue": "65535",
        "x6076_DefaultValue": "100000",
    }
    path = without(tmp_path, x608Fsub1_DefaultValue="196608", x6091sub1_DefaultValue="32", **values)
    found = {
        f.subject: f.text for f in foresee(tx40, 0, read_device_file(path, 1)) if f.severity == "warning"
    }
    assert "software position limits are -1000 to 1000 counts" in found["607D"]
    assert "limits the speed to 100 rpm" in found["6080"]
    assert "window of 500 counts; the loop as described lags" in found["6065"] and "% of it" in found["6065"]
    assert "the drive may give 2.097e+05 at the output" in found["6072"]


def test_nothing_hides_behind_the_first_obstacle(tx40: Robot, tmp_path: Path) -> None:
    found = refusals(tx40, without(tmp_path, "6077", "60C2", "1016", "1400sub5"))
    assert list(found) == ["6077", "60C2", "1016", "608F"]
    assert "counts_per_output_turn" in found["608F"], "1/1, as the file of a maker has it"


@pytest.mark.parametrize("name", ["epos4_like.eds", "prbt_like.dcf"])
def test_files_of_makers_are_read_to_the_end(tx40: Robot, name: str) -> None:
    found = foresee(tx40, 0, read_device_file(HERE / name, 1))
    assert found and all(finding.text for finding in found)


def test_doctor_and_opening_say_the_same_of_one_slot_and_no_torque(
    tx40: Robot, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """TPDOs of one entry: both spread them; without 6077 both refuse, until a maker's object is named."""
    channel = Channel("virtual", request.node.name)
    signal = ControlSignal(index=0x2022, subindex=0, per_count=0.0005)
    arm = drives_changed(tx40, control_signal=signal)
    made = described_devices(tx40, Quirks(absent=(0x6077,), tpdo_slots=1, tpdos=4))
    with drives(tx40, channel, devices=made), pytest.raises(DriveError, match="reading 6077:00"):
        ArmSession(tx40, channel).open()
    made = described_devices(arm, Quirks(absent=(0x6077,), tpdo_slots=1, tpdos=4))
    with drives(arm, channel, devices=made), ArmSession(arm, channel) as session:
        assert len(session._connection.links()[0].transmitted()) == 3
    assert "6077" in refusals(tx40, without(tmp_path, "6077"))
