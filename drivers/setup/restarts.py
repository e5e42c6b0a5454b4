"""Has a drive started anew since it was configured? Then it maps and watches as its maker thought fit.

A boot-up message may come while nobody listens, so what was written is read again, too: before each motion.
"""

from __future__ import annotations

from collections.abc import Mapping

from drivers.cia402 import objects
from drivers.setup.drive import DriveReport
from drivers.setup.sdo import SdoAccess

_PDOS = range(objects.RPDO_COMMUNICATION, objects.TPDO_MAPPING + 0x200)
_LASTING = (objects.HEARTBEAT_PRODUCER, objects.ABORT_OPTION, objects.INTERPOLATION_PERIOD)
_NO_REMOTE_FRAMES = 1 << 30
"""Bit of a PDO's COB-ID entry that is the drive's own affair."""

Settings = Mapping[tuple[int, int], bytes]


def lasting_settings(sdo: SdoAccess) -> dict[tuple[int, int], bytes]:
    """Of what a drive was told, that which must stay as it is: PDOs, period, watch."""
    return {key: data for key, data in sdo.written.items() if key[0] in _PDOS or key[0] in _LASTING}


def lost_setting(sdo: SdoAccess, settings: Settings, report: DriveReport) -> str | None:
    """The first setting that a drive no longer has, in words; None where it has all.

    Args:
        sdo: the drive.
        settings: of :func:`lasting_settings`, after the set-up.
        report: of the set-up.

    Raises:
        DriveError: no answer.
    """
    # A drive that shows its mode only when enabled keeps it in 6060.
    display = objects.MODE if report.profile.mode_shown_when_enabled else objects.MODE_DISPLAY
    if (mode := sdo.read_int(display, signed=True)) != report.mode:
        return f"6061 reads {mode}, {report.mode} was set"
    for (index, subindex), wanted in settings.items():
        found = sdo.read_int(index, subindex)
        told = int.from_bytes(wanted, "little")
        if index in _PDOS and subindex == 1 and len(wanted) == 4 and not _maps(index):
            found, told = found & ~_NO_REMOTE_FRAMES, told & ~_NO_REMOTE_FRAMES
        if found != told:
            return f"{index:04X}:{subindex:02X} reads 0x{found:X}, 0x{told:X} was set"
    return None


def _maps(index: int) -> bool:
    """Whether an object in the range of PDOs is a mapping."""
    rpdo = objects.RPDO_MAPPING <= index < objects.TPDO_COMMUNICATION
    return rpdo or index >= objects.TPDO_MAPPING
