"""Device files with the gaps that real ones have, and broken ones."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers import DriveError, Finding
from drivers.setup.device_file import DeviceFile
from drivers.setup.device_needs import compare_identity
from drivers.setup.eds import read_device_file
from drivers.setup.mapping import refuse_shared_cob_ids
from drivers.simulated.object_dictionary import EDS_PATH

FOLDER = Path(__file__).parent / "eds"


def by_subject(file: DeviceFile) -> dict[str, Finding]:
    return {finding.subject: finding for finding in file.findings}


@pytest.fixture(scope="module")
def epos() -> DeviceFile:
    return read_device_file(FOLDER / "epos4_like.eds", 2)


@pytest.fixture(scope="module")
def prbt() -> DeviceFile:
    return read_device_file(FOLDER / "prbt_like.dcf", 3)


def test_a_positioning_controller_without_standard_torque_objects(epos: DeviceFile) -> None:
    assert (epos.vendor, epos.product) == (0xFB, 0x61500000)
    found = by_subject(epos)
    assert found["text"].text == "not UTF-8, read as Windows-1252"
    assert "name the maker's own object as control_signal" in found["6077"].text
    assert found["6077"].severity == "warning"
    assert {"608F:01", "6091:01"} <= set(found), "units cannot be cross-checked"
    assert "OPTIONALOBJECTS says 45 objects and lists 42" in found["lists"].text
    assert "Vendor Tool Settings" in found["sections"].text
    assert "'no value' is no number" in found["6076:00"].text
    demand = epos.objects[0x30D1, 1]
    assert (demand.bits, demand.mappable) == (32, True), "this one does not fit beside position and status"
    assert epos.objects[0x1800, 1].default == 0x182, "$NODEID has its place"
    assert epos.objects[0x607D, 1].default == -(2**31)
    assert not any(finding.severity == "refusal" for finding in epos.findings)


def test_an_arm_joint_with_interpolated_position_alone(prbt: DeviceFile) -> None:
    assert prbt.node_id == 3
    found = by_subject(prbt)
    absent = {"6007", "605A", "608F:01", "6076"}
    assert absent <= set(found) and all(found[name].text.startswith("absent") for name in absent)
    assert "interpolated position mode" in found["607A"].text
    assert "6502" in found["sections"].text, "the doubled section"
    assert prbt.has(0x60C1, 1) and prbt.has(0x60C1, 2), "compact sub-objects"
    assert prbt.objects[0x60C2, 1].default == 8, "octal"
    assert prbt.objects[0x1800, 1].value == 0x183


def test_the_simulated_drives_own_file_has_nothing_to_report() -> None:
    file = read_device_file(EDS_PATH, 5)
    assert file.findings == ()
    assert file.objects[0x6041, 0].mappable


def fixed(folder: Path) -> Path:
    """The same file of a drive whose first TPDO keeps its COB-ID."""
    text = (FOLDER / "prbt_like.dcf").read_text("utf-8")
    head, _, rest = text.partition("[1800sub1]")
    path = folder / "fixed.dcf"
    path.write_text(head + "[1800sub1]" + rest.replace("AccessType=rw", "AccessType=ro", 1), "utf-8")
    return path


def test_a_cob_id_that_the_set_up_writes_is_not_shared(prbt: DeviceFile) -> None:
    assert prbt.transmitted_cob_ids() == {0x083: "1014"}


def test_one_dcf_in_two_nodes_makes_them_share_an_id(tmp_path: Path) -> None:
    prbt, again = (read_device_file(fixed(tmp_path), node) for node in (3, 4))
    assert again.transmitted_cob_ids() == {0x183: "1800", 0x084: "1014"}
    refuse_shared_cob_ids({"drive 3": prbt.transmitted_cob_ids()})
    with pytest.raises(DriveError, match="drive 4: 1800 holds COB-ID 0x183, as drive 3 does"):
        refuse_shared_cob_ids({"drive 3": prbt.transmitted_cob_ids(), "drive 4": again.transmitted_cob_ids()})
    with pytest.raises(DriveError, match="0x080, which no drive may send on"):
        refuse_shared_cob_ids({"drive 5": {0x080: "1014"}})


def test_the_identity_of_the_file_beside_the_drives(epos: DeviceFile) -> None:
    assert compare_identity(epos, (0xFB, 0x61500000, 0x01700000)) == []
    assert [f.severity for f in compare_identity(epos, (0xFB, 0x61500000, 1))] == ["info"]
    other = compare_identity(epos, (0xFB, 0x62100000, 0x01700000))
    assert [f.severity for f in other] == ["refusal"]
    assert "product 0x61500000, the drive says 0x62100000" in other[0].text
    assert compare_identity(epos, (None, None, None)) == []


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read: No such file"),
        (b"", "has no object of a CANopen device; allowed: an EDS or DCF"),
        (b"\x00\x01\x02" * 50, "has no object"),
        (b"[FileInfo]\nFileName=x\n", "has no object"),
    ],
)
def test_what_is_no_device_file_is_refused_in_one_line(
    tmp_path: Path, content: bytes | None, message: str
) -> None:
    path = tmp_path / "drive.eds"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DriveError, match=message) as refusal:
        read_device_file(path, 1)
    assert "\n" not in str(refusal.value)


WHOLE = (FOLDER / "epos4_like.eds").read_bytes()


@settings(max_examples=40)
@given(st.integers(0, len(WHOLE)), st.binary(max_size=12), st.integers(0, 40))
def test_no_damage_makes_anything_but_a_report_or_a_refusal(cut: int, put: bytes, drop: int) -> None:
    path = FOLDER.parent / "no-such-file"
    damaged = WHOLE[:cut] + put + WHOLE[cut + drop :]

    class Memory(type(path)):  # type: ignore[misc]
        def open(self, *args: object, **kwargs: object) -> object:
            return io.BytesIO(damaged)

    with contextlib.suppress(DriveError):
        assert read_device_file(Memory(path), 2).objects


def test_a_truncated_file_says_what_the_master_would_miss(tmp_path: Path) -> None:
    path = tmp_path / "half.eds"
    path.write_bytes(WHOLE[: WHOLE.index(b"[6040]")])
    found = by_subject(read_device_file(path, 2))
    assert found["6040"].severity == found["6064"].severity == "refusal"
    assert found["607A"].text == "absent, and no 60C1: the drive takes no set-points"
