"""Whose SYNC a drive hears, and whether it sends one of its own (CiA 301, 7.5.2.5: object 1005h)."""

from __future__ import annotations

from drivers.cia402 import objects
from drivers.frames.layout import SYNC_COB_ID
from drivers.setup.findings import Finding
from drivers.setup.sdo import SdoAccess

_GENERATES = 1 << 30
_IDENTIFIER = 0x3FFF_FFFF
"""The identifier with the bit that says whether it has 29 bits."""


def sync_findings(sdo: SdoAccess, cycle_time: float) -> list[Finding]:
    """A drive that makes SYNC by itself, or that waits for another one than the master's, is refused.

    That 1006h is 0 means nothing to most drives; some ignore their set-points then. One that waits for SYNC
    at another period may report that it stays away.

    Args:
        sdo: the drive.
        cycle_time: s between two SYNCs.

    Raises:
        DriveError: no answer.
    """
    word = sdo.read_optional(objects.SYNC_COB_ID)
    if word is None:
        return []
    if word & _GENERATES:
        return [Finding("refusal", "1005", "the drive sends SYNC by itself (bit 30): there would be two")]
    if word & _IDENTIFIER != SYNC_COB_ID:
        text = f"the drive waits for SYNC 0x{word & _IDENTIFIER:03X}, the master sends 0x{SYNC_COB_ID:03X}"
        return [Finding("refusal", "1005", text)]
    period = sdo.read_optional(objects.SYNC_PERIOD)
    if period and period != round(1e6 * cycle_time):
        text = (
            f"the drive expects a SYNC every {period} µs, bus.cycle_time is {1e6 * cycle_time:.10g} µs: it "
            "may report a missing SYNC; set one of them, or a profile with sync_period"
        )
        return [Finding("warning", "1006", text)]
    if period == 0:
        text = "0: where set-points turn out to be ignored, a profile with sync_period writes the SYNC period"
        return [Finding("info", "1006", text)]
    return []
