"""The CAN bus and the drives on it."""

from drivers.bus.access import BusLock, describe_cob_id, listen_for_traffic, open_bus
from drivers.bus.channel import Channel
from drivers.cyclic.job import Budgets
from drivers.cyclic.requests import Request, StreamControl
from drivers.cyclic.samples import Outcome, Samples, StreamResult
from drivers.errors import BusError, DriveError
from drivers.session import ArmSession
from drivers.setup.drive import DriveReport
from drivers.setup.findings import Finding
from drivers.setup.homing import Homing

__all__ = [
    "ArmSession",
    "Budgets",
    "BusError",
    "BusLock",
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
