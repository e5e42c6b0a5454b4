"""The CAN bus and the drives on it."""

from drivers.bus import BusLock, describe_cob_id, listen_for_traffic, open_bus
from drivers.channel import Channel
from drivers.errors import BusError, DriveError
from drivers.findings import Finding
from drivers.job import Budgets
from drivers.requests import Request, StreamControl
from drivers.samples import Outcome, Samples, StreamResult
from drivers.session import ArmSession
from drivers.setup import DriveReport

__all__ = [
    "ArmSession",
    "Budgets",
    "BusError",
    "BusLock",
    "Channel",
    "DriveError",
    "DriveReport",
    "Finding",
    "Outcome",
    "Request",
    "Samples",
    "StreamControl",
    "StreamResult",
    "describe_cob_id",
    "listen_for_traffic",
    "open_bus",
]
