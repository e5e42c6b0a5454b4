"""What the master wants of a device file: the objects that it uses, and the identity of the drive."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.setup.device_file import DeviceFile, ObjectEntry
from drivers.setup.findings import Finding

NEEDED: dict[tuple[int, int], tuple[str, str]] = {
    (0x1018, 1): ("refusal", "identity: nothing tells this drive from another"),
    (0x6040, 0): ("refusal", "controlword: the drive cannot be enabled"),
    (0x6041, 0): ("refusal", "statusword: nobody knows its state"),
    (0x6060, 0): ("refusal", "modes of operation"),
    (0x6061, 0): ("refusal", "mode display: a refused mode would not show"),
    (0x6064, 0): ("refusal", "actual position"),
    (0x60C2, 1): ("refusal", "interpolation period: the drive does not know the SYNC period"),
    (0x1600, 1): ("refusal", "RPDO mapping"),
    (0x1A00, 1): ("refusal", "TPDO mapping"),
    (0x1016, 1): ("warning", "heartbeat consumer: the drive notices no lost master by it"),
    (0x1017, 0): ("warning", "heartbeat producer: only missing TPDOs show a dead drive"),
    (0x6007, 0): ("info", "abort option: the reaction to a lost master cannot be chosen"),
    (0x605A, 0): ("info", "quick stop option: how halt stops is the drive's own affair"),
    (0x605E, 0): ("info", "fault reaction option"),
    (0x6065, 0): ("warning", "following error window: only the master watches"),
    (0x6076, 0): ("info", "rated torque: torque limits cannot be compared, gain is configuration"),
    (0x607D, 1): ("warning", "software position limits"),
    (0x608F, 1): ("info", "encoder resolution: encoder_counts cannot be cross-checked"),
    (0x6091, 1): ("info", "gear ratio: gear cannot be cross-checked"),
    (0x6502, 0): ("warning", "supported modes: csp is tried"),
}
"""What the set-up uses, with what its absence means."""
SET_POINTS = ((0x607A, 0), (0x60C1, 1))
CONTROL_SIGNALS = ((0x6077, 0), (0x6074, 0), (0x6078, 0))


def missing_objects(objects: Mapping[tuple[int, int], ObjectEntry]) -> list[Finding]:
    """What the master would use and the device does not have, by severity."""
    found = []
    for (index, subindex), (severity, meaning) in NEEDED.items():
        if (index, subindex) not in objects:
            subject = f"{index:04X}" + (f":{subindex:02X}" if subindex else "")
            found.append(Finding(severity, subject, f"absent: {meaning}"))  # type: ignore[arg-type]
    if not any(key in objects for key in SET_POINTS):
        found.append(Finding("refusal", "607A", "absent, and no 60C1: the drive takes no set-points"))
    elif SET_POINTS[0] not in objects:
        found.append(Finding("info", "607A", "absent: interpolated position mode is used (60C1)"))
    standard = [key for key in CONTROL_SIGNALS if key in objects]
    if not standard:
        text = "absent, and no 6074 or 6078: name the maker's own object as control_signal"
        found.append(Finding("warning", "6077", text))
    elif not any(objects[key].mappable for key in standard):
        found.append(Finding("warning", "6077", "no standard control signal can be mapped into a PDO"))
    return found


def compare_identity(file: DeviceFile, found: tuple[int | None, int | None, int | None]) -> list[Finding]:
    """The file's identity beside the drive's (1018h): vendor, product, revision.

    Another vendor or product is refused: the file is of another device. Revisions differ in practice.
    """
    compared = []
    wanted = (("vendor", file.vendor), ("product", file.product), ("revision", file.revision))
    for (name, value), actual in zip(wanted, found, strict=True):
        if value is None or actual is None or value == actual:
            continue
        text = f"{file.path.name} is of {name} 0x{value:08X}, the drive says 0x{actual:08X}"
        compared.append(Finding("info" if name == "revision" else "refusal", "identity", text))
    return compared
