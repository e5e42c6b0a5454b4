"""Configuration of one drive over SDO: identity, mapping, mode, period. It never enables torque."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from drivers.cia402 import objects
from drivers.cia402.states import TORQUE_STATES, State, state_of
from drivers.errors import DriveError
from drivers.layout import RPDO_OBJECTS, MappedObject, rpdo_cob_id, tpdo_cob_id, tpdo_objects
from drivers.sdo import SdoAccess
from robots.description import Drive

DISABLED = 1 << 31
"""Bit 31 of a PDO's COB-ID entry: the PDO does not exist."""
SYNCHRONOUS = 1
"""Transmission type: at every SYNC."""
OTHER_PDOS = (1, 2, 3)
"""Number of the second to fourth PDO, counted from the first."""
HEARTBEAT_MILLISECONDS = 100
READY_TIMEOUT = 3.0
"""s that a drive may take for its self-test."""
MODE_TIMEOUT = 1.0
"""s that a drive may take to show a mode that it accepted."""


@dataclass(frozen=True)
class DriveReport:
    """What the set-up found at one drive."""

    joint: str
    node_id: int
    vendor: int
    product: int | None
    revision: int | None
    serial: int | None
    device_type: int
    supported_modes: int | None
    control_signal_bits: int
    statusword: int
    settings: dict[str, int | None] = field(default_factory=dict)
    """Safety-relevant objects by name; None where the drive does not have one."""
    notes: tuple[str, ...] = ()

    @property
    def state(self) -> State:
        """The power state at the end of the set-up."""
        return state_of(self.statusword)


def interpolation_period(seconds: float) -> tuple[int, int]:
    """60C2h for a SYNC period: value (1–255) and power of ten, with value · 10^power = period.

    Raises:
        DriveError: no such pair gives the period exactly.
    """
    for power in range(0, -7, -1):
        value = seconds * 10.0**-power
        if 1 <= round(value) <= 255 and abs(value - round(value)) < 1e-6 * value:
            return round(value), power
    raise DriveError(
        f"bus.cycle_time {seconds} s cannot be written as interpolation period (60C2); "
        "allowed: 1 to 255 times a power of ten from 1 µs"
    )


def configure(sdo: SdoAccess, drive: Drive, joint: str, cycle_time: float) -> DriveReport:
    """Bring one drive, in NMT pre-operational, to where the cyclic process can take over.

    Every setting is written and read back. Order of the mapping as in CiA 301, 7.5.2.36: PDO off, mapping
    off, entries, mapping on, PDO on.

    Args:
        sdo: its object dictionary.
        drive: its description.
        joint: name of its joint.
        cycle_time: SYNC period, s.

    Raises:
        DriveError: no answer, a refused or changed value, a drive that carries torque, no CSP.
    """
    _refuse_torque(sdo)
    identity = _identity(sdo)
    notes: list[str] = []
    modes = _check_modes(sdo, notes)
    control_signal = _control_signal(sdo, drive)
    _silence_other_pdos(sdo)
    _map_pdo(sdo, objects.RPDO_COMMUNICATION, objects.RPDO_MAPPING, rpdo_cob_id(drive.node_id), RPDO_OBJECTS)
    _map_pdo(
        sdo,
        objects.TPDO_COMMUNICATION,
        objects.TPDO_MAPPING,
        tpdo_cob_id(drive.node_id),
        tpdo_objects(control_signal),
    )
    _set_mode(sdo)
    _set_period(sdo, cycle_time)
    _set_heartbeat(sdo, notes)
    return DriveReport(
        joint=joint,
        node_id=drive.node_id,
        vendor=identity[0] or 0,
        product=identity[1],
        revision=identity[2],
        serial=identity[3],
        device_type=sdo.read_int(objects.DEVICE_TYPE),
        supported_modes=modes,
        control_signal_bits=control_signal.bits,
        statusword=sdo.read_int(objects.STATUSWORD),
        settings={
            name: sdo.read_optional(index, subindex, signed=signed)
            for name, (index, subindex, signed) in objects.SETTINGS.items()
        },
        notes=tuple(notes),
    )


def _refuse_torque(sdo: SdoAccess) -> None:
    """Wait for the end of the self-test; a drive that carries torque already has another master."""
    deadline = time.monotonic() + READY_TIMEOUT
    while True:
        state = state_of(sdo.read_int(objects.STATUSWORD))
        if state is not State.NOT_READY:
            break
        if time.monotonic() > deadline:
            raise DriveError(f"{sdo.drive} is still {state.value!r} after {READY_TIMEOUT:g} s")
        time.sleep(0.02)
    if state in TORQUE_STATES:
        raise DriveError(f"{sdo.drive} is in state {state.value!r}: something else controls it")


def _identity(sdo: SdoAccess) -> tuple[int | None, ...]:
    """Vendor id (mandatory), product code, revision and serial number (1018h)."""
    vendor = sdo.read_int(objects.IDENTITY, 1)
    return vendor, *(sdo.read_optional(objects.IDENTITY, subindex) for subindex in (2, 3, 4))


def _check_modes(sdo: SdoAccess, notes: list[str]) -> int | None:
    modes = sdo.read_optional(objects.SUPPORTED_MODES)
    if modes is None:
        notes.append("supported modes (6502) absent: not checked")
    elif not modes >> (objects.CYCLIC_SYNCHRONOUS_POSITION - 1) & 1:
        raise DriveError(f"{sdo.drive}: 6502 = 0x{modes:08X} has no cyclic synchronous position mode (bit 7)")
    return modes


def _control_signal(sdo: SdoAccess, drive: Drive) -> MappedObject:
    """The control-signal object with the width that the drive itself gives it."""
    signal = drive.control_signal
    return MappedObject(signal.index, signal.subindex, 8 * len(sdo.read(signal.index, signal.subindex)))


def _silence_other_pdos(sdo: SdoAccess) -> None:
    """Disable the second to fourth PDOs: they would load the bus or share a COB-ID."""
    for first in (objects.RPDO_COMMUNICATION, objects.TPDO_COMMUNICATION):
        for number in OTHER_PDOS:
            cob_id = sdo.read_optional(first + number, 1)
            if cob_id is not None and not cob_id & DISABLED:
                sdo.write_checked(first + number, 1, cob_id | DISABLED, 4)


def _map_pdo(
    sdo: SdoAccess, communication: int, mapping: int, cob_id: int, entries: tuple[MappedObject, ...]
) -> None:
    sdo.write(communication, 1, cob_id | DISABLED, 4)
    sdo.write(mapping, 0, 0, 1)
    for number, entry in enumerate(entries, start=1):
        sdo.write_checked(mapping, number, entry.word, 4)
    sdo.write_checked(mapping, 0, len(entries), 1)
    sdo.write_checked(communication, 2, SYNCHRONOUS, 1)
    sdo.write(communication, 1, cob_id, 4)
    # Bit 30 (no remote frames) is the drive's own affair; id and validity are ours.
    found = sdo.read_int(communication, 1)
    if found & ~(1 << 30) != cob_id:
        raise DriveError(
            f"{sdo.drive}: {communication:04X}:01 was set to 0x{cob_id:X} but reads back as 0x{found:X}"
        )


def _set_mode(sdo: SdoAccess) -> None:
    mode = objects.CYCLIC_SYNCHRONOUS_POSITION
    sdo.write(objects.MODE, 0, mode, 1)
    deadline = time.monotonic() + MODE_TIMEOUT
    while (shown := sdo.read_int(objects.MODE_DISPLAY, signed=True)) != mode:
        if time.monotonic() > deadline:
            raise DriveError(f"{sdo.drive}: mode {mode} (csp) was set but 6061 shows {shown}")
        time.sleep(0.02)


def _set_period(sdo: SdoAccess, cycle_time: float) -> None:
    value, power = interpolation_period(cycle_time)
    sdo.write_checked(objects.INTERPOLATION_PERIOD, 1, value, 1)
    sdo.write_checked(objects.INTERPOLATION_PERIOD, 2, power, 1)


def _set_heartbeat(sdo: SdoAccess, notes: list[str]) -> None:
    if sdo.read_optional(objects.HEARTBEAT_PRODUCER) is None:
        notes.append("heartbeat producer (1017) absent: only missing TPDOs show a dead drive")
    else:
        sdo.write_checked(objects.HEARTBEAT_PRODUCER, 0, HEARTBEAT_MILLISECONDS, 2)


def acknowledge_fault(sdo: SdoAccess, timeout: float = 1.0) -> None:
    """Reset a drive's fault by a rising edge of controlword bit 7.

    Raises:
        DriveError: the fault stays.
    """
    sdo.write(objects.CONTROLWORD, 0, 0x00, 2)
    sdo.write(objects.CONTROLWORD, 0, 0x80, 2)
    deadline = time.monotonic() + timeout
    while state_of(sdo.read_int(objects.STATUSWORD)) in (State.FAULT, State.FAULT_REACTION):
        if time.monotonic() > deadline:
            raise DriveError(f"{sdo.drive}: the fault stays after a fault reset")
        time.sleep(0.02)
    sdo.write(objects.CONTROLWORD, 0, 0x00, 2)
