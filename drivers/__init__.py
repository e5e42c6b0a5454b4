"""The CAN bus and the drives on it."""

from typing import TYPE_CHECKING

from robots.lazy import exporter

if TYPE_CHECKING:
    from drivers.bus.access import describe_cob_id, listen_for_traffic, open_bus
    from drivers.bus.bus_lock import BusLock
    from drivers.errors import BusError, BusOccupied, DriveError
    from drivers.frames.channel import Channel
    from drivers.frames.job import Budgets
    from drivers.frames.requests import StreamControl
    from drivers.frames.ring import Request
    from drivers.frames.samples import Outcome, Samples, StreamResult
    from drivers.session.arm_session import ArmSession
    from drivers.setup.drive import DriveReport
    from drivers.setup.findings import Finding
    from drivers.setup.homing import Homing

__all__ = [
    "ArmSession",
    "Budgets",
    "BusError",
    "BusLock",
    "BusOccupied",
    "Channel",
    "DriveError",
    "DriveReport",
    "Finding",
    "Homing",
    "Outcome",
    "Request",
    "Samples",
    "StreamControl",
    "StreamResult",
    "describe_cob_id",
    "listen_for_traffic",
    "open_bus",
]

__getattr__ = exporter(
    __name__,
    {
        "drivers.bus.access": (
            "describe_cob_id",
            "listen_for_traffic",
            "open_bus",
        ),
        "drivers.bus.bus_lock": ("BusLock",),
        "drivers.errors": (
            "BusError",
            "BusOccupied",
            "DriveError",
        ),
        "drivers.frames.channel": ("Channel",),
        "drivers.frames.job": ("Budgets",),
        "drivers.frames.requests": ("StreamControl",),
        "drivers.frames.ring": ("Request",),
        "drivers.frames.samples": (
            "Outcome",
            "Samples",
            "StreamResult",
        ),
        "drivers.session.arm_session": ("ArmSession",),
        "drivers.setup.drive": ("DriveReport",),
        "drivers.setup.findings": ("Finding",),
        "drivers.setup.homing": ("Homing",),
    },
)
