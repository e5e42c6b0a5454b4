"""One cycle on the wire: SYNC out, the drives' TPDOs in, RPDOs out; raw frames and fixed layouts."""

from __future__ import annotations

import struct
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence

from drivers.bus.access import describe_cob_id
from drivers.bus.error_frames import ERROR_FLAG, error_report
from drivers.bus.ports import Frame, FramePort
from drivers.cia402.emergency import EmergencyMessage
from drivers.cyclic.answers import Answers
from drivers.cyclic.foreign import is_answer, own_cob_ids, written_object
from drivers.frames.layout import (
    NMT_COB_ID,
    RPDO,
    SYNC_COB_ID,
    DriveLink,
    emcy_cob_id,
    heartbeat_cob_id,
    sdo_answer_cob_id,
    sdo_request_cob_id,
)

OPERATIONAL = 5
"""NMT state in a heartbeat (CiA 301, 7.2.8.3.2)."""
_BOOT_UP = 0
_ALIVE = bytes([OPERATIONAL])
LONGEST_NAP = 0.001
"""s; longer answers are the exception, which must not set the rule."""
_NAP_GAIN = 0.25
_NAP_SHRINK = 0.998
_USUAL = ("statusword", "position", "control_signal")
"""Of the one TPDO that most drives send."""


class Exchange:
    """The latest word of each drive, and the frames to and from them.

    Args:
        port: opened for foreign.receive_cob_ids; it is used, not closed.
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
        self.answers = Answers(links, [len(link.transmitted()) for link in links])
        self.complete = self.answers.complete
        """Whether each drive has answered the latest SYNC; always the same list."""
        self.emergencies: list[list[EmergencyMessage]] = [[] for _ in links]
        """EMCYs heard that are no resets, per axis."""
        self.nmt_state: list[int | None] = [None] * n
        """As of the latest heartbeat, per axis."""
        self.heard: list[float] = [0.0] * n
        """When the latest heartbeat was taken in, s on the clock."""
        self.operational_at = [0] * n
        """SYNC after which each drive's latest heartbeat said that it is operational; 0 before the first."""
        self.beating = [axis for axis, link in enumerate(links) if link.heartbeat > 0]
        """Axes whose drives have heartbeats."""
        self.confirmed_until = 0 if self.beating else sys.maxsize
        """The earliest of ``operational_at`` among them: what answered SYNCs before it was operational."""
        self.signs = 0
        """Heartbeats and EMCYs so far: what was said of a drive's life may have changed with each."""
        self.booted = [False] * n
        """Drives that have sent a boot-up message: they have lost their configuration."""
        self.bus_failure: str | None = None
        """Why the bus cannot be relied on any more."""
        self.reports = Counter[str]()
        """What the controller said of itself, and how often."""
        self.confirmed = [False] * n
        """Drives that have answered the latest SDO request."""
        self.send_failures = 0
        self._port = port
        self._clock, self._sleep = clock, sleep
        self._heartbeat_id = heartbeat_cob_id(master_node)
        self._nodes = [link.node for link in links]
        self._send_rpdos = port.prepare([link.rpdo_cob_id for link in links], RPDO.size)
        self._sorters = self._make_sorters(links)
        for cob_id in own_cob_ids(links, master_node):
            self._sorters[cob_id] = self._foreign(cob_id)
        self._asked = [b""] * n
        self._nap = 0.0
        self._lost = 0
        """Frames lost on this side, as of the latest SYNC."""

    def _make_sorters(self, links: Sequence[DriveLink]) -> dict[int, Callable[[bytes], None]]:
        sorters: dict[int, Callable[[bytes], None]] = {}
        for axis, link in enumerate(links):
            pdos = link.transmitted()
            if len(pdos) == 1 and pdos[0].fields == _USUAL:
                layout = pdos[0].layout
                sorters[pdos[0].cob_id] = self._whole_tpdo(axis, layout.size, layout.unpack)
            else:
                for number, pdo in enumerate(pdos):
                    places = [getattr(self, field) for field in pdo.fields]
                    sorters[pdo.cob_id] = self._part_of_tpdo(axis, 1 << number, pdo.layout, places)
            sorters[emcy_cob_id(link.node)] = self._emcy(axis, link.name, link.warnings)
            sorters[heartbeat_cob_id(link.node)] = self._heartbeat(axis)
            sorters[sdo_answer_cob_id(link.node)] = self._sdo_answer(axis)
            sorters[sdo_request_cob_id(link.node)] = self._foreign_sdo(link.node)
        return sorters

    # One cycle ------------------------------------------------------------------------------

    def sync(self) -> None:
        """Take in what is left of the last cycle, then send the SYNC.

        A TPDO that comes now is late, or a second one: it belongs to the SYNC before.
        """
        if frames := self._port.drain():
            self._take(frames)
        lost = self._port.overflows()
        failure = self.answers.close(lost=lost > self._lost)
        self._lost = max(lost, self._lost)
        self.bus_failure = self.bus_failure or failure
        self._send(SYNC_COB_ID, b"")

    def receive(self, until: float) -> bool:
        """Take TPDOs until each drive has answered or the time (s on the clock) is over.

        To be woken for every frame costs more than the frames. So it sleeps first for as long as the
        the last answers took, and only then waits for those that are still missing.

        Returns:
            Whether all answered.
        """
        start = self._clock()
        nap = min(self._nap, until - start)
        if nap > 0:
            self._sleep(nap)
        answers = self.answers
        self._take(self._port.drain())
        if not answers.missing:
            self._nap *= _NAP_SHRINK
            return True
        while answers.missing and (left := until - self._clock()) > 0:
            self._port.wait(left)
            self._take(self._port.drain())
        if not answers.missing:
            took = self._clock() - start
            self._nap = min(LONGEST_NAP, self._nap + _NAP_GAIN * (took - self._nap))
        return not answers.missing

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
        self._asked[axis] = request[1:4]
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
        self.reports[report.text] += 1
        if report.fatal:
            self._fail(report.text)

    def _whole_tpdo(
        self, axis: int, size: int, unpack: Callable[[bytes], tuple[int, ...]]
    ) -> Callable[[bytes], None]:
        answers, complete = self.answers, self.complete
        words, positions, signals = self.statusword, self.position, self.control_signal

        def sort(data: bytes) -> None:
            if len(data) != size:
                answers.odd_size(axis, len(data))
                return
            words[axis], positions[axis], signals[axis] = unpack(data)
            if complete[axis]:
                answers.again(axis)
                return
            complete[axis] = True
            answers.missing -= 1

        return sort

    def _part_of_tpdo(
        self, axis: int, part: int, layout: struct.Struct, places: list[list[int]]
    ) -> Callable[[bytes], None]:
        """For one of a drive's TPDOs, with its bit and the lists that its values go to."""
        size, unpack, answers = layout.size, layout.unpack, self.answers

        def sort(data: bytes) -> None:
            if len(data) != size:
                answers.odd_size(axis, len(data))
                return
            for place, value in zip(places, unpack(data), strict=True):
                place[axis] = value
            answers.part(axis, part)

        return sort

    def _emcy(self, axis: int, name: str, warnings: frozenset[int]) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            message = EmergencyMessage.decode(data)
            if message is None or message.is_reset:
                return
            if message.code in warnings:
                self.reports[f"{name}: {message} (a warning of this kind of drive)"] += 1
                return
            self.emergencies[axis].append(message)
            self.signs += 1

        return sort

    def _heartbeat(self, axis: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            if len(data) != 1:
                return
            state = data[0] & 0x7F
            self.booted[axis] = self.booted[axis] or state == _BOOT_UP
            self.nmt_state[axis], self.heard[axis] = state, self._clock()
            if state == OPERATIONAL:
                at = self.operational_at
                at[axis] = self.answers.syncs
                self.confirmed_until = min([at[k] for k in self.beating], default=sys.maxsize)
            self.signs += 1

        return sort

    def _foreign(self, cob_id: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            self._fail(f"another master is on the bus: it has sent {describe_cob_id(cob_id)}")

        return sort

    def _foreign_sdo(self, node: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            if (what := written_object(data)) is not None:
                self._fail(f"another master is on the bus: it writes {what} of node {node} (SDO)")
            else:
                self.reports[f"something else reads objects of node {node} (SDO)"] += 1

        return sort

    def _fail(self, reason: str) -> None:
        self.bus_failure = self.bus_failure or reason

    def _sdo_answer(self, axis: int) -> Callable[[bytes], None]:
        def sort(data: bytes) -> None:
            self.confirmed[axis] = self.confirmed[axis] or is_answer(data, self._asked[axis])

        return sort
