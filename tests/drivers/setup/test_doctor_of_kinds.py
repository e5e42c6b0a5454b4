"""The doctor's word on each kind of simulated drive, from a device file as its maker would have written it.

The column "doctor" of benchmarks/drives.md is what stands here.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.setup.eds import read_device_file
from drivers.setup.foresee import foresee
from drivers.simulated.device import described_devices
from drivers.simulated.drive import Drive
from drivers.simulated.quirks import KINDS, Quirks
from robots import Robot

TYPES = {"b": 2, "h": 3, "i": 4, "B": 5, "H": 6, "I": 7}


def written(robot: Robot, quirks: Quirks, path: Path) -> Path:
    """The first drive of an arm, all of this kind, as an EDS: its objects, access rights and values."""
    drive = Drive(robot, 0, 1, lambda cob_id, data: None, described_devices(robot, quirks)[0])
    lines = ["[DeviceInfo]", "VendorNumber=0", "ProductNumber=0x402", ""]
    for (index, subindex), entry in sorted(drive.dictionary._entries.items()):
        if not entry.format:
            continue
        record = max(s for i, s in drive.dictionary._entries if i == index) > 0
        name = f"{index:04X}sub{subindex:X}" if record else f"{index:04X}"
        fixed = quirks.fixed_mapping and (0x1600 <= index < 0x1800 or 0x1A00 <= index < 0x1C00)
        fixed = fixed or (quirks.fixed_cob_ids and index in (0x1400, 0x1800, 0x1801) and subindex == 1)
        lines += [f"[{name}]", "ParameterName=x", "ObjectType=0x7", f"DataType={TYPES[entry.format]}"]
        lines += [f"AccessType={'ro' if fixed else entry.access}", f"PDOMapping={int(entry.mappable)}"]
        lines += [f"DefaultValue={drive.dictionary.integer(index, subindex)}"]
        if quirks.rpdo_types and (index, subindex) == (0x1400, 2):
            lines += [f"LowLimit={min(quirks.rpdo_types)}", f"HighLimit={max(quirks.rpdo_types)}"]
        lines.append("")
    path.write_text("\n".join(lines), "ascii")
    return path


SAYS = {
    "fixed_cob_ids": {("info", "1400", "the COB-ID is fixed, 0x201: used as it is")},
    "fixed_mapping": {("info", "1600", "the mapping is used as it is")},
    "immediate_rpdos": {("warning", "1400", "transmission type 255: set-points act as they come")},
    "no_interpolation_period": {("refusal", "60C2", "60C2:01: the drive refuses: the object does not exist")},
    "no_heartbeat_consumer": {("warning", "1016", "absent: the drive notices a lost master by its RPDO")},
    "no_torque": {("refusal", "6077", "absent: the control signal has no object; write control_signal")},
    "one_slot": set(),
    "eight_tpdos": set(),
    "interpolated_only": {("info", "6502", "no csp: interpolated position mode is used")},
    "absent_08000000": {("info", "6007", "absent"), ("info", "605A", "quick stop: the drive does not say")},
    "mode_shown_late": set(),
    "unsized": set(),
    "needs_sync_period": {("info", "1006", "0: where set-points turn out to be ignored, a profile with")},
    "locked": set(),
    "warns_when_enabled": set(),
    "fixed_cob_ids_four_tpdos": {("info", "1800", "the COB-ID is fixed, 0x181: used as it is")},
    "node_guarding_only": {("refusal", "1016", "no heartbeat consumer (absent) and no RPDO deadline")},
    "one_rpdo_slot": {("refusal", "PDO", "no RPDO can carry 6040:00 and 607A:00 alone")},
    "abort_option_fixed": {("info", "6007", "the drive takes no fault as abort option, it has 2 now")},
    "period_fixed": set(),
    "period_power_fixed": set(),
    "period_fixed_when_enabled": set(),
    "mode_fixed": set(),
    "rpdo_type_fixed": set(),
    "late_tpdos": set(),
    "sync_period_fixed": {("warning", "1006", "the drive expects a SYNC every 10000 µs")},
}
"""By kind: severity, object, and some of the words; no file shows what the kinds without a word do."""


@pytest.mark.parametrize("kind", SAYS)
def test_what_the_doctor_says(tx40: Robot, tmp_path: Path, kind: str) -> None:
    path = written(tx40, KINDS[kind], tmp_path / "drive.eds")
    found = foresee(tx40, 0, read_device_file(path, 1))
    told = [(finding.severity, finding.subject, finding.text) for finding in found]
    for severity, subject, words in SAYS[kind]:
        assert any(s == severity and o == subject and words in text for s, o, text in told), told
    refused = {subject for severity, subject, _ in told if severity == "refusal"}
    assert refused == {subject for severity, subject, _ in SAYS[kind] if severity == "refusal"}


def test_neither_watch(tx40: Robot, tmp_path: Path) -> None:
    text = written(tx40, Quirks(absent=(0x1016,)), tmp_path / "drive.eds").read_text("ascii")
    (tmp_path / "drive.eds").write_text(text.replace("[1400sub5]", "[2FFFsub5]"), "ascii")
    found = foresee(tx40, 0, read_device_file(tmp_path / "drive.eds", 1))
    (refusal,) = [finding for finding in found if finding.severity == "refusal"]
    assert "no heartbeat consumer (absent) and no RPDO deadline" in str(refusal)
