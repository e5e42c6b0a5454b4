"""What a drive is told before and beside its PDOs: start-up objects of its kind, mode, period."""

from __future__ import annotations

import time

from drivers.cia402 import objects
from drivers.errors import DriveError
from drivers.frames.period import interpolation_period
from drivers.setup.findings import Finding
from drivers.setup.profiles import STANDARD, Profile
from drivers.setup.sdo import SdoAccess, aborted

LATEST_TPDO = 0.8
"""Share of the SYNC period in which the answers of the slowest drive must have come."""
MODE_TIMEOUT = 1.0
"""s that a drive may take to show a mode that it accepted."""

_MOST = 255
"""Of 60C2:01, one byte."""
_MODE_NAMES = {
    objects.HOMING: "homing",
    objects.INTERPOLATED_POSITION: "ip",
    objects.CYCLIC_SYNCHRONOUS_POSITION: "csp",
}


def choose_mode(sdo: SdoAccess, modes: int | None, findings: list[Finding]) -> int:
    """Cyclic synchronous position; interpolated position for drives that have only that."""
    if modes is None:
        findings.append(Finding("warning", "6502", "supported modes absent: csp is tried"))
        return objects.CYCLIC_SYNCHRONOUS_POSITION
    for mode in (objects.CYCLIC_SYNCHRONOUS_POSITION, objects.INTERPOLATED_POSITION):
        if modes >> (mode - 1) & 1:
            if mode == objects.INTERPOLATED_POSITION:
                findings.append(Finding("info", "6502", "no csp: interpolated position mode is used"))
            return mode
    raise DriveError(
        f"{sdo.drive}: 6502 = 0x{modes:08X} has neither cyclic synchronous position mode (bit 7) nor "
        "interpolated position mode (bit 6)"
    )


def start_up(sdo: SdoAccess, profile: Profile, cycle_time: float, findings: list[Finding]) -> None:
    """What this kind of drive wants to be told first.

    Raises:
        DriveError: it refuses, or keeps another value.
    """
    if profile.name != STANDARD:
        findings.append(Finding("info", "profile", f"{profile.name}: {profile.summary}"))
    if profile.tpdo_delay > LATEST_TPDO * cycle_time:
        raise DriveError(
            f"{sdo.drive}: its TPDOs come up to {1e3 * profile.tpdo_delay:g} ms after the SYNC (profile "
            f"{profile.name}); bus.cycle_time must be at least {1e3 * profile.tpdo_delay / LATEST_TPDO:g} ms"
        )
    for (index, subindex), bits in profile.widths:
        sdo.widths[index, subindex] = bits // 8
    for order in profile.startup:
        try:
            sdo.write_checked(order.index, order.subindex, order.value, order.bits // 8)
        except DriveError as error:
            raise DriveError(f"{error}; profile {profile.name} needs it: {order.why}") from error
    if profile.sync_period:
        sdo.ensure(objects.SYNC_PERIOD, 0, round(cycle_time * 1e6), 4)


def set_mode(sdo: SdoAccess, mode: int, *, shown: bool = True) -> None:
    """Set 6060h, and wait until 6061h shows the same: a drive may stay in its old mode without a word.

    Args:
        sdo: the drive.
        mode: number of the mode.
        shown: False for a drive that shows its mode only when operation is enabled.

    Raises:
        DriveError: the drive refuses the mode and is in another one, or does not show it in time.
    """
    if mode == objects.INTERPOLATED_POSITION and sdo.read_optional(objects.INTERPOLATION_SUBMODE) is not None:
        sdo.ensure(objects.INTERPOLATION_SUBMODE, 0, 0, 2)  # linear
    try:
        sdo.write(objects.MODE, 0, mode, 1)
    except DriveError as error:
        # Some drives have one mode, chosen with their tool: 6060 is read-only or absent.
        if aborted(error) is None or sdo.read_optional(objects.MODE_DISPLAY, signed=True) != mode:
            raise
    deadline = time.monotonic() + MODE_TIMEOUT
    while shown and (displayed := sdo.read_int(objects.MODE_DISPLAY, signed=True)) != mode:
        if time.monotonic() > deadline:
            raise DriveError(
                f"{sdo.drive}: mode {mode} ({_MODE_NAMES[mode]}) was set but 6061 shows {displayed}"
            )
        time.sleep(0.02)


def set_period(sdo: SdoAccess, cycle_time: float, profile: Profile, findings: list[Finding]) -> None:
    """60C2h: the SYNC period, as value and power of ten, or with the power that the drive keeps.

    Raises:
        DriveError: the drive has no 60C2 and its profile does not say so, or keeps another period.
    """
    index = objects.INTERPOLATION_PERIOD
    if not profile.interpolation_period and sdo.read_optional(index, 1) is None:
        text = "absent: how the drive fills the time between two SYNCs is its own affair"
        findings.append(Finding("warning", "60C2", text))
        return
    value, power = interpolation_period(cycle_time)
    try:
        sdo.write_checked(index, 1, value, 1)
        sdo.write_checked(index, 2, power, 1)
    except DriveError as error:
        if aborted(error) is None or not _period_with_its_power(sdo, cycle_time):
            raise


def _period_with_its_power(sdo: SdoAccess, cycle_time: float) -> bool:
    """Set 60C2:01 beside a power of ten that the drive keeps; whether it holds this period then.

    Raises:
        DriveError: it keeps another period; says which one.
    """
    index = objects.INTERPOLATION_PERIOD
    power, held = sdo.read_optional(index, 2, signed=True), sdo.read_optional(index, 1)
    if power is None or held is None:
        return False
    value = cycle_time * 10.0**-power
    if abs(value - round(value)) > 1e-6 * value or not 1 <= round(value) <= _MOST:
        return False
    try:
        sdo.ensure(index, 1, round(value), 1)
    except DriveError as error:
        if aborted(error) is None or not held:
            raise
        raise DriveError(f"{error}, or bus.cycle_time to {held * 10.0**power:g} s") from error.__cause__
    return True
