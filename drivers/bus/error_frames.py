"""What a CAN controller says of itself in error frames (Linux ``can/error.h``), in words."""

from __future__ import annotations

from dataclasses import dataclass

ERROR_FLAG = 0x2000_0000
"""In a SocketCAN id: the frame is none of the bus but the controller's own report."""

TX_TIMEOUT, CONTROLLER, NO_ACKNOWLEDGE, BUS_OFF, RESTARTED = 0x001, 0x004, 0x020, 0x040, 0x100
_OVERFLOW, _WARNING, _PASSIVE = 0x03, 0x0C, 0x30
"""Bits of the second data byte of a controller report: receive and transmit side of each."""


@dataclass(frozen=True)
class ErrorReport:
    """One report of the controller.

    Attributes:
        text: in words.
        fatal: the bus cannot be relied on: the arm must be stopped, and stays stopped.
        lost: received frames were lost inside the controller.
    """

    text: str
    fatal: bool = False
    lost: bool = False


def error_report(can_id: int, data: bytes) -> ErrorReport | None:
    """What an error frame says that matters to a master; None for single bit errors, which CAN repairs.

    Bus-off, and a controller that was restarted after it, are fatal, and so is error-passive: 128 errors
    without a rest are a broken bus, and the next step from there is bus-off.

    Args:
        can_id: with or without the error flag.
        data: its payload; byte 1 is the state of the controller.
    """
    kind = can_id & 0x1FFF_FFFF
    if kind & BUS_OFF:
        return ErrorReport("the CAN controller went off the bus (bus-off)", fatal=True)
    if kind & RESTARTED:
        return ErrorReport("the CAN controller was restarted after bus-off", fatal=True)
    state = data[1] if kind & CONTROLLER and len(data) > 1 else 0
    if state & _PASSIVE:
        return ErrorReport("the CAN controller is error-passive: cable, termination or bit rate", fatal=True)
    if state & _OVERFLOW:
        return ErrorReport("the CAN controller's buffer overflowed: frames were lost", lost=True)
    if state & _WARNING:
        return ErrorReport("the CAN controller counts many errors (error-warning)")
    if kind & TX_TIMEOUT:
        return ErrorReport("the CAN controller could not send a frame in time")
    if kind & NO_ACKNOWLEDGE:
        return ErrorReport("no other node acknowledges frames")
    return None
