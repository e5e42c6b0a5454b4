"""Transmission types of PDOs (CiA 301, 7.5.2.35 and 7.5.2.37): at every SYNC, or what a drive has instead."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.errors import DriveError
from drivers.setup.findings import Finding
from drivers.setup.sdo import SdoAccess, aborted

SYNCHRONOUS = 1
"""At every SYNC."""


@dataclass(frozen=True)
class Types:
    """What a PDO may have: what is tried, best first, and what will do where it cannot be written."""

    tried: tuple[int, ...]
    kept: frozenset[int]


RECEIVED = Types((SYNCHRONOUS, 255, 254), frozenset(range(241)) | {254, 255})
"""An RPDO of any synchronous type acts with the next SYNC."""
SENT = Types((SYNCHRONOUS,), frozenset({SYNCHRONOUS}))


def set_type(sdo: SdoAccess, communication: int, types: Types, findings: list[Finding]) -> None:
    """Set the type of a PDO; an RPDO may also act at once where the drive has nothing else.

    Raises:
        DriveError: the drive takes none of the types, and has another one.
    """
    kind = _settle(sdo, communication, types)
    if kind in (254, 255):
        text = f"transmission type {kind}: set-points act as they come, not at the next SYNC"
        findings.append(Finding("warning", f"{communication:04X}", text))


def _settle(sdo: SdoAccess, communication: int, types: Types) -> int:
    refusal: DriveError | None = None
    for kind in types.tried:
        try:
            sdo.write_checked(communication, 2, kind, 1)
        except DriveError as error:
            if aborted(error) is None:
                raise
            refusal = refusal or error
        else:
            return kind
    kept = sdo.read_int(communication, 2)
    if kept not in types.kept:
        raise DriveError(
            f"{refusal}; it holds {kept}: set {communication:04X}:02 to 1 in the drive"
        ) from refusal
    return kept
