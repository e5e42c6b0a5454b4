"""One cycle on the wire: SYNC out, the drives' TPDOs in, RPDOs out; raw frames and fixed layouts."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence

from drivers.bus.access import describe_cob_id
from drivers.bus.error_frames import ERROR_FLAG, error_report
from drivers.bus.ports import Frame, FramePort
from drivers.cia402.emergency import EmergencyMessage
from drivers.cyclic.layout import (
    NMT_COB_ID,
    RPDO,
    SYNC_COB_ID,
    DriveLink,
    emcy_cob_id,
    fits_beside_position,
    heartbeat_cob_id,
    rpdo_cob_id,
    sdo_answer_cob_id,
    sdo_request_cob_id,
    second_tpdo_cob_id,
    tpdo_cob_id,
    tpdo_layouts,
)

OPERATIONAL = 5
"""NMT state in a heartbeat (CiA 301, 7.2.8.3.2)."""
_BOOT_UP = 0
_ALIVE = bytes([OPERATIONAL])
LONGEST_NAP = 0.001
"""s; longer answers are the exception, which must not set the rule."""
_NAP_GAIN = 0.25
_NAP_SHRINK = 0.998


def receive_cob_ids(links: Sequence[DriveLink], master_node: int) -> list[int]:
    """What the cyclic process listens to: what drives send, and what nobody but itself may send."""
    kinds = (tpdo_cob_id, second_tpdo_cob_id, emcy_cob_id, heartbeat_cob_id, sdo_answer_cob_id)
    return [*(kind(link.node) for link in links for kind in kinds), *_own_cob_ids(links, master_node)]


def _own_cob_ids(links: Sequence[DriveLink], master_node: int) -> list[int]:
    """COB-IDs of this master; own frames are not received, so one that is comes from another master."""
    rpdos = [rpdo_cob_id(link.node) for link in links]
    return [NMT_COB_ID, SYNC_COB_ID, heartbeat_cob_id(master_node), *rpdos]


def _layouts(link: DriveLink) -> tuple[struct.Struct, ...]:
    return tpdo_layouts(link.control_signal_bits, link.velocity_bits)


class Exchange:
    """The latest word of each drive, and the frames to and from them.

    Args:
        port: opened for receive_cob_ids; it is used, not closed.
        links: the drives in the order of the axes.
        master_node: node id in the master's own heartbeat.
        clock, sleep: time, s.
    """

    def __init__(
        self,
        port: FramePort,
        links: Sequence[DriveLink],
        master_node: int = 127,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        n = len(links)
        self.statusword = [0] * n
        self.position = [0] * n
        self.control_signal = [0] * n
        self.velocity = [0] * n
        """Of drives that send it; else 0."""
        self.complete = [False] * n
        self.doubled = [False] * n
        """Drives whose answer to the SYNC before came after the next one's: theirs was one SYNC late."""
        self.emergencies: list[list[EmergencyMessage]] = [[] for _ in links]
        """EMCYs heard that are no resets, per axis."""
        self.nmt_state: list[int | None] = [None] * n
        """As of the latest heartbeat, per axis."""
        self.heard: list[float] = [0.0] * n
        """When the latest heartbeat was taken in, s on the clock."""
        self.booted = [False] * n
        """Drives that have sent a boot-up message: they have lost their configuration."""
        self.bus_failure: str | None = None
        """Why the bus cannot be relied on any more."""
        self.reports: dict[str, int] = {}
        """What the controller said of itself, and how often."""
        self.confirmed = [False] * n
        """Drives that have answered the latest SDO request."""
        self.send_failures = 0
        self._port = port
        self._clock, self._sleep = clock, sleep
        self._heartbeat_id = heartbeat_cob_id(master_node)
        self._nodes = [link.node for link in links]
        self._send_rpdos = port.prepare([rpdo_cob_id(link.node) for link in links], RPDO.size)
        self._whole = [(1 << len(_layouts(link))) - 1 for link in links]
        self._parts = [0] * n
        self._missing = n
        self._sorters = self._make_sorters(links)
        for cob_id in _own_cob_ids(links, master_node):
            self._sorters[cob_id] = self._foreign(cob_id)
        self._nap = 0.0

    def _make_sorters(self, links: Sequence[DriveLink]) -> dict[int, Callable[[bytes], None]]:
        sorters: dict[int, Callable[[bytes], None]] = {}
        for axis, link in enumerate(links):
            layouts = _layouts(link)
            if len(layouts) == 1:
                sorters[tpdo_cob_id(link.node)] = self._whole_tpdo(axis, layouts[0].size, layouts[0].unpack)
            else:
                first, second = layouts
                beside = fits_beside_position(link.control_signal_bits)
                signal = [self.control_signal]
                state = [self.statusword, self.position, *(signal if beside else [])]
                rest = [*([] if beside else signal), *([self.velocity] if link.velocity_bits else [])]
                sorters[tpdo_cob_id(link.node)] = self._part_of_tpdo(axis, 1, first, state)
                sorters[second_tpdo_cob_id(link.node)] = self._part_of_tpdo(axis, 2, second, rest)
            sorters[emcy_cob_id(link.node)] = self._emcy(axis)
            sorters[heartbeat_cob_id(link.node)] = self._heartbeat(axis)
            sorters[sdo_answer_cob_id(link.node)] = self._sdo_answer(axis)
        return sorters

    # One cycle ------------------------------------------------------------------------------

    def sync(self) -> None:
        """Take in what is left of the last cycle, then send the SYNC.

        A TPDO that comes now belongs to the SYNC before and must not pass for the answer to this one.
        """
        had = self.complete
        self._await_all()
        if frames := self._port.drain():
            self._take(frames)
        self.doubled = [before and now for before, now in zip(had, self.complete, strict=True)]
        self._await_all()
        self._send(SYNC_COB_ID, b"")

    def receive(self, until: float) -> bool:
        """Take TPDOs until each drive has answered or the time (s on the clock) is over.

        To be woken for every frame costs more than the frames. So it sleeps first for as long as the
        answers took lately, and only then waits for those that are still missing.

        Returns:
            Whether all answered.
        """
        start = self._clock()
        nap = min(self._nap, until - start)
        if nap > 0:
            self._sleep(nap)
        self._take(self._port.drain())
        if not self._missing:
            self._nap *= _NAP_SHRINK
            return True
        while self._missing and (left := until - self._clock()) > 0:
            self._port.wait(left)
            self._take(self._port.drain())
        if not self._missing:
            took = self._clock() - start
            self._nap = min(LONGEST_NAP, self._nap + _NAP_GAIN * (took - self._nap))
        return not self._missing

    def send(self, controlwords: Sequence[int], targets: Sequence[int]) -> None:
        """Send each drive its controlword and set-point, in counts; latched at the next SYNC."""
        self.send_failures += self._send_rpdos(list(map(RPDO.pack, controlwords, targets)))

    def send_heartbeat(self) -> None:
        """The master's own sign of life (CiA 301, 7.2.8.2.2)."""
        self._send(self._heartbeat_id, _ALIVE)

    def overflows(self) -> int:
        """Received frames that were lost on this side since the beginning."""
        return self._port.overflows()

    # Outside the cycle ------------------------------------------------------------------------

    def write_object(self, axis: int, index: int, subindex: int, value: int) -> None:
        """Ask a drive to write four bytes to an object (SDO, expedited); ``confirmed`` tells the answer."""
        self.confirmed[axis] = False
        request = bytes([0x23, index & 0xFF, index >> 8, subindex]) + value.to_bytes(4, "little")
        self._send(sdo_request_cob_id(self._nodes[axis]), request)

    def command_nmt(self, command: int) -> None:
        """Send an NMT command to each of the drives, and to nobody else."""
        for node in self._nodes:
            self._send(NMT_COB_ID, bytes([command, node]))

    def _send(self, cob_id: int, data: bytes) -> None:
        # A refusal is judged with the cycles that then stay unanswered: there is no more to do about it here.
        if not self._port.send(cob_id, data):
            self.send_failures += 1

    # Sorting --------------------------------------------------------------------------------

    def _await_all(self) -> None:
        n = len(self._nodes)
        self.complete = [False] * n
        self._parts = [0] * n
        self._missing = n

    def _take(self, frames: list[Frame]) -> None:
        sorters = self._sorters
        for cob_id, data in frames:
            sorter = sorters.get(cob_id)
            if sorter is not None:
                sorter(data)
            elif cob_id & ERROR_FLAG:
                self._take_report(cob_id, data)

    def _take_report(self, can_id: int, data: bytes) -> None:
        report = error_report(can_id, data)
        if report is None:
            return
        self.reports[report.text] = self.reports.get(report.text, 0) + 1
        if report.fatal and self.bus_failure is None:
            self.bus_failure = report.text

    def _whole_tpdo(
        self, axis: int, size: int, unpack: Callable[[bytes], tuple[int, ...]]
    ) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            if len(data) == size:
                self.statusword[axis], self.position[axis], self.control_signal[axis] = unpack(data)
                if not self.complete[axis]:
                    self.complete[axis] = True
                    self._missing -= 1

        return sort

    def _part_of_tpdo(
        self, axis: int, part: int, layout: struct.Struct, places: list[list[int]]
    ) -> Callable[[bytes], None]:
        """For one of a drive's two TPDOs, with the lists that its values go to."""
        size, unpack = layout.size, layout.unpack

        def sort(data: bytes) -> None:
            if len(data) == size:
                for place, value in zip(places, unpack(data), strict=True):
                    place[axis] = value
                self._note_part(axis, part)

        return sort

    def _note_part(self, axis: int, part: int) -> None:
        self._parts[axis] |= part
        if self._parts[axis] == self._whole[axis] and not self.complete[axis]:
            self.complete[axis] = True
            self._missing -= 1

    def _emcy(self, axis: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            message = EmergencyMessage.decode(data)
            if message is not None and not message.is_reset:
                self.emergencies[axis].append(message)

        return sort

    def _heartbeat(self, axis: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            if len(data) != 1:
                return
            state = data[0] & 0x7F
            self.booted[axis] = self.booted[axis] or state == _BOOT_UP
            self.nmt_state[axis], self.heard[axis] = state, self._clock()

        return sort

    def _foreign(self, cob_id: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            if self.bus_failure is None:
                self.bus_failure = f"another master is on the bus: it has sent {describe_cob_id(cob_id)}"

        return sort

    def _sdo_answer(self, axis: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            # Any answer, an abort too: a drive that has no such object has nothing to be written.
            self.confirmed[axis] = len(data) == 8

        return sort
