"""Open a CAN bus by channel, and find out whether somebody already uses it."""

from __future__ import annotations

import errno
import socket
import time
from collections.abc import Iterable
from pathlib import Path

import can

from drivers.bus.multicast import LocalMulticastBus, enlarge_receive_buffer
from drivers.errors import BusError
from drivers.frames.channel import Channel

__all__ = [
    "BusError",
    "Channel",
    "describe_cob_id",
    "listen_for_traffic",
    "open_bus",
]

DEFAULT_BITRATE = 1_000_000


def open_bus(
    channel: Channel,
    receive: Iterable[int] | None = None,
    bitrate: int = DEFAULT_BITRATE,
) -> can.BusABC:
    """Open a bus that receives only the given COB-IDs and none of its own frames.

    Args:
        channel: which bus.
        receive: 11-bit COB-IDs to accept; all where None.
        bitrate: bit/s, for interfaces whose hardware is set from here; socketcan's is the system's.

    Raises:
        BusError: the bus cannot be opened; one line with the reason.
    """
    filters: can.typechecking.CanFilters | None = None
    if receive is not None:
        filters = [{"can_id": i, "can_mask": 0x7FF, "extended": False} for i in sorted(set(receive))]
    try:
        return _open(channel, filters, bitrate)
    except (NameError, AttributeError, TypeError) as error:
        # How python-can's interfaces fail where the maker's library is not installed.
        raise BusError(
            f"cannot open {channel}: the driver of interface {channel.interface} is missing"
        ) from error
    except (OSError, can.CanError, ImportError, ValueError) as error:
        raise BusError(f"cannot open {channel}: {_reason(channel, error)}") from error


def _open(channel: Channel, filters: can.typechecking.CanFilters | None, bitrate: int) -> can.BusABC:
    if channel.interface == "udp_multicast":
        return LocalMulticastBus(*channel.group_and_port(), can_filters=filters)
    if channel.interface in ("socketcan", "virtual"):
        bus = can.Bus(interface=channel.interface, channel=channel.name, can_filters=filters)
        sock = getattr(bus, "socket", None)
        if isinstance(sock, socket.socket):
            enlarge_receive_buffer(sock)
        return bus
    return can.Bus(
        interface=channel.interface,
        channel=channel.name,
        can_filters=filters,
        bitrate=bitrate,
    )


def _reason(channel: Channel, error: Exception) -> str:
    cause = error if isinstance(error, OSError) else error.__cause__
    number = cause.errno if isinstance(cause, OSError) else None
    if channel.interface == "socketcan":
        if number in (errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT):
            return "this machine's kernel has no CAN"
        if number in (errno.ENODEV, errno.ENXIO):
            found = ", ".join(_can_devices()) or "none"
            return f"there is no CAN device {channel.name!r}; devices here: {found}"
    if number == errno.ENETDOWN:
        return "the device is down"
    if number in (errno.EACCES, errno.EPERM):
        return "permission denied"
    return str(error).splitlines()[0] if str(error) else type(error).__name__


def _can_devices() -> list[str]:
    """Names of the CAN devices of this machine (ARPHRD_CAN is 280)."""
    kinds = Path("/sys/class/net").glob("*/type")
    return sorted(kind.parent.name for kind in kinds if kind.read_text().strip() == "280")


def listen_for_traffic(
    channel: Channel, seconds: float = 0.3, cob_ids: Iterable[int] | None = None
) -> frozenset[int]:
    """COB-IDs that others send on a bus while nothing is sent from here.

    Args:
        channel: which bus.
        seconds: how long to listen.
        cob_ids: which ones count; all where None.

    Raises:
        BusError: the bus cannot be opened.
    """
    heard: set[int] = set()
    with open_bus(channel, cob_ids) as bus:
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            message = bus.recv(timeout=left)
            if message is not None and not message.is_error_frame:
                heard.add(message.arbitration_id)
    return frozenset(heard)


def describe_cob_id(cob_id: int) -> str:
    """What a COB-ID is in the predefined connection set (CiA 301, 7.3.3)."""
    fixed = {0x000: "NMT command", 0x080: "SYNC"}
    if cob_id in fixed:
        return f"0x{cob_id:03X} ({fixed[cob_id]})"
    kinds = {
        1: "EMCY",
        3: "TPDO1",
        4: "RPDO1",
        5: "TPDO2",
        6: "RPDO2",
        7: "TPDO3",
        8: "RPDO3",
    }
    kinds |= {
        9: "TPDO4",
        10: "RPDO4",
        11: "SDO answer",
        12: "SDO request",
        14: "heartbeat",
    }
    kind = kinds.get(cob_id >> 7, "frame")
    return f"0x{cob_id:03X} ({kind} of node {cob_id & 0x7F})"
