"""The SYNC period as drives are told it (60C2h)."""

from __future__ import annotations

from drivers.errors import DriveError


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
