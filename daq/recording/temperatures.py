"""Temperatures that the drives report, as ``sensor_msgs/Temperature``."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from typing import Self

from daq.recording.cdr import CdrDecoder, CdrEncoder
from daq.recording.steady_clock import SteadyClock
from drivers.errors import BusError, DriveError
from drivers.session.arm_session import ArmSession

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Temperature:
    """One reading."""

    stamp: int
    """ns since the epoch."""
    joint: str
    celsius: float

    def encode(self) -> bytes:
        """As ``sensor_msgs/msg/Temperature``, with the joint as frame_id."""
        encoder = CdrEncoder()
        encoder.primitive("int32", self.stamp // 1_000_000_000)
        encoder.primitive("uint32", self.stamp % 1_000_000_000)
        encoder.string(self.joint)
        encoder.primitive("float64", self.celsius)
        encoder.primitive("float64", 0.0)
        return encoder.finish()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """The inverse of :meth:`encode`.

        Raises:
            daq.recording.cdr.CdrError: the bytes are no such message.
        """
        decoder = CdrDecoder(data)
        seconds, nanoseconds = int(decoder.primitive("int32")), int(decoder.primitive("uint32"))
        joint = decoder.string()
        return cls(seconds * 1_000_000_000 + nanoseconds, joint, float(decoder.primitive("float64")))


def drive_temperatures(session: ArmSession, clock: SteadyClock) -> tuple[Temperature, ...]:
    """What the drives say now, where their description names the object; a few SDOs, so not while it moves.

    A drive that does not answer is a warning in the log: for a temperature no run is ended.
    """
    if all(drive.temperature is None for drive in session.robot.drive):
        return ()
    stamp = clock.now()
    try:
        celsius = session.temperatures().tolist()
    except (BusError, DriveError) as error:
        log.warning("temperatures are not recorded: %s", error)
        return ()
    readings = zip(session.robot.joint, celsius, strict=True)
    return tuple(Temperature(stamp, j.name, value) for j, value in readings if not math.isnan(value))
