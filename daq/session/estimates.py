"""What a run will take: time, and room on the disk."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from daq.session.session_error import SessionError
from robots import Robot

BYTES_PER_CYCLE, BYTES_PER_JOINT = 130.0, 130.0
"""Of one cycle of a compressed capture with raw frames: for itself, and for each joint. The simulated arms
take 206 with one joint and 735 with six; a quarter is added, for noise compresses worse."""

FIXED_BYTES = 100_000.0
"""Description, URDF and index of a capture."""

ROOM = 2.0
"""So many times the estimate has to be free, for the disk is not ours alone."""


@dataclass(frozen=True)
class Estimate:
    """Of one run."""

    seconds: float
    size: float
    """Bytes."""

    def words(self) -> str:
        """For people."""
        minutes, seconds = divmod(round(self.seconds), 60)
        time = f"{minutes} min {seconds:02d} s" if minutes else f"{seconds} s"
        return f"{time}, {self.size / 1e6:.1f} MB"


def estimate(robot: Robot, seconds: float) -> Estimate:
    """What a recording of so many seconds takes."""
    cycles = seconds / robot.bus.cycle_time
    return Estimate(seconds, FIXED_BYTES + (BYTES_PER_CYCLE + BYTES_PER_JOINT * robot.n) * cycles)


def require_room(folder: Path, wanted: Estimate) -> None:
    """Is there room for a recording, before anything moves?

    Raises:
        SessionError: there is not.
    """
    free = shutil.disk_usage(folder).free
    if free < ROOM * wanted.size:
        raise SessionError(
            f"{folder}: {free / 1e6:.0f} MB are free; needed: {ROOM * wanted.size / 1e6:.0f} MB,"
            f" twice what the recording takes"
        )
