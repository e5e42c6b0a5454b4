"""One cycle on the wire: SYNC out, the drives' TPDOs in, RPDOs out; raw frames and fixed layouts."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import can

from drivers.layout import (
    RPDO,
    SYNC_COB_ID,
    emcy_cob_id,
    heartbeat_cob_id,
    rpdo_cob_id,
    tpdo_cob_id,
    tpdo_layout,
)

OPERATIONAL = 5
"""NMT state in a heartbeat (CiA 301, 7.2.8.3.2)."""
_BUS_OFF = 0x40
"""In the id of a SocketCAN error frame: the controller went off the bus."""


def receive_cob_ids(nodes: Sequence[int]) -> list[int]:
    """What the cyclic process listens to."""
    return [f(node) for node in nodes for f in (tpdo_cob_id, emcy_cob_id, heartbeat_cob_id)]


class Exchange:
    """The latest word of each drive, and the frames to and from them.

    Args:
        bus: opened for receive_cob_ids; it is used, not closed.
        nodes: node ids in the order of the axes.
        control_signal_bits: width of the control signal in each drive's TPDO.
        clock: monotonic time, s.
    """

    def __init__(
        self,
        bus: can.BusABC,
        nodes: Sequence[int],
        control_signal_bits: Sequence[int],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        n = len(nodes)
        self.statusword = [0] * n
        self.position = [0] * n
        self.control_signal = [0] * n
        self.complete = [False] * n
        self.doubled = [False] * n
        """Drives whose answer to the SYNC before came after the next one's: theirs was one SYNC late."""
        self.emergencies: list[list[int]] = [[] for _ in nodes]
        """EMCY codes heard, per axis."""
        self.nmt_state: list[int | None] = [None] * n
        """As of the latest heartbeat, per axis."""
        self.bus_off = False
        self.send_failures = 0
        self._bus = bus
        self._clock = clock
        self._layouts = [tpdo_layout(bits) for bits in control_signal_bits]
        self._tpdo = {tpdo_cob_id(node): axis for axis, node in enumerate(nodes)}
        self._emcy = {emcy_cob_id(node): axis for axis, node in enumerate(nodes)}
        self._heartbeat = {heartbeat_cob_id(node): axis for axis, node in enumerate(nodes)}
        # Messages are made once: making one costs more than the rest of the cycle's arithmetic.
        self._sync = can.Message(arbitration_id=SYNC_COB_ID, is_extended_id=False)
        self._rpdo = [
            can.Message(arbitration_id=rpdo_cob_id(node), is_extended_id=False, data=bytes(RPDO.size))
            for node in nodes
        ]

    def sync(self) -> None:
        """Take in what is left of the last cycle, then send the SYNC.

        A TPDO that comes now belongs to the SYNC before and must not pass for the answer to this one.
        """
        had, self.complete = self.complete, [False] * len(self.complete)
        while (message := self._bus.recv(timeout=0)) is not None:
            self._take(message)
        self.doubled = [before and now for before, now in zip(had, self.complete, strict=True)]
        self.complete = [False] * len(self.complete)
        self._send(self._sync)

    def receive(self, until: float) -> bool:
        """Take TPDOs until each drive has answered or the time (s on the clock) is over.

        Returns:
            Whether all answered.
        """
        missing = self.complete.count(False)
        while missing and (left := until - self._clock()) > 0:
            message = self._bus.recv(timeout=left)
            if message is not None and self._take(message):
                missing = self.complete.count(False)
        return not missing

    def send(self, controlwords: Sequence[int], targets: Sequence[int]) -> None:
        """Send each drive its controlword and target position, in counts; latched at the next SYNC."""
        for message, controlword, target in zip(self._rpdo, controlwords, targets, strict=True):
            RPDO.pack_into(message.data, 0, controlword, target)
            self._send(message)

    def _send(self, message: can.Message) -> None:
        try:
            self._bus.send(message)
        except can.CanError:
            # Judged with the cycles that then stay unanswered: there is no more to do about it here.
            self.send_failures += 1

    def _take(self, message: can.Message) -> bool:
        """Sort one frame in; whether it was a TPDO."""
        if message.is_error_frame:
            self.bus_off = self.bus_off or bool(message.arbitration_id & _BUS_OFF)
            return False
        cob_id, data = message.arbitration_id, message.data
        axis = self._tpdo.get(cob_id)
        if axis is not None:
            layout = self._layouts[axis]
            if len(data) != layout.size:
                return False
            self.statusword[axis], self.position[axis], self.control_signal[axis] = layout.unpack(data)
            self.complete[axis] = True
            return True
        if (axis := self._emcy.get(cob_id)) is not None and len(data) >= 2:
            code = int.from_bytes(data[:2], "little")
            if code:
                self.emergencies[axis].append(code)
        elif (axis := self._heartbeat.get(cob_id)) is not None and len(data) == 1:
            self.nmt_state[axis] = data[0] & 0x7F
        return False
