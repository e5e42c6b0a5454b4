"""The CAN bus and the drives on it."""

from drivers.bus import BusLock, describe_cob_id, listen_for_traffic, open_bus
from drivers.channel import Channel
from drivers.errors import BusError, DriveError

__all__ = [
    "BusError",
    "BusLock",
    "Channel",
    "DriveError",
    "describe_cob_id",
    "listen_for_traffic",
    "open_bus",
]
