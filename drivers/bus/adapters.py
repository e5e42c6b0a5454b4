"""What python-can's interfaces tell a master, and what they do not (python-can 4.6)."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.bus.error_frames import CONTROLLER, ERROR_FLAG

_WARNING_LIMIT, _PASSIVE_LIMIT = 96, 128
"""Error counters of ISO 11898-1."""


@dataclass(frozen=True)
class Adapter:
    """One interface.

    Attributes:
        state: whether bus-off and error-passive reach the master.
        stamps: whether frames carry the time at which the adapter has received them.
        extra: of this distribution, with what the interface needs; empty where it needs nothing.
    """

    state: bool
    stamps: bool
    extra: str = ""


ADAPTERS = {
    "socketcan": Adapter(state=True, stamps=True),
    "ixxat": Adapter(state=True, stamps=True),
    "pcan": Adapter(state=True, stamps=True),
    "gs_usb": Adapter(state=True, stamps=True, extra="gs-usb"),
    "kvaser": Adapter(state=False, stamps=True),
    "slcan": Adapter(state=False, stamps=False, extra="slcan"),
}
"""By python-can's name. gs_usb: where the firmware sends error frames and time stamps."""


def pcan_report(data: bytes) -> tuple[int, bytes]:
    """An error frame of PCAN-Basic as a controller report of Linux: id with the error flag, and payload.

    Its id is the kind of a single error (1 bit, 2 form, 4 stuff, 8 other) and byte 1 its place in the frame,
    neither of them what Linux has there; bytes 2 and 3 are the receive and transmit error counters
    (PCAN-Basic, "Error Frames").

    Args:
        data: its payload.
    """
    counter = max(data[2:4], default=0)
    state = 0x30 if counter >= _PASSIVE_LIMIT else 0x0C if counter >= _WARNING_LIMIT else 0
    return ERROR_FLAG | CONTROLLER, bytes([0, state, 0, 0, 0, 0, 0, 0])
