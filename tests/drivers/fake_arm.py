"""Scripted drives in virtual time: what the loop sends is obeyed and kept, what goes wrong is in a script."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import can

from drivers.cia402.states import State
from drivers.frames.layout import RPDO, tpdo_layouts

WORDS = {
    State.SWITCH_ON_DISABLED: 0x0040,
    State.READY: 0x0021,
    State.SWITCHED_ON: 0x0023,
    State.OPERATION_ENABLED: 0x0027,
    State.QUICK_STOP: 0x0007,
    State.FAULT: 0x0008,
}
UP = {
    (State.SWITCH_ON_DISABLED, 0x06): State.READY,
    (State.READY, 0x07): State.SWITCHED_ON,
    (State.READY, 0x0F): State.SWITCHED_ON,
    (State.SWITCHED_ON, 0x0F): State.OPERATION_ENABLED,
    (State.OPERATION_ENABLED, 0x07): State.SWITCHED_ON,
    (State.OPERATION_ENABLED, 0x06): State.READY,
    (State.SWITCHED_ON, 0x06): State.READY,
}


class Clock:
    """Time that only sleeping and waiting move."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@dataclass
class Axis:
    """One drive: it is where its target was, one SYNC later."""

    node: int
    state: State = State.SWITCH_ON_DISABLED
    position: int = 1000
    silent: bool = False
    """Neither hears nor answers."""
    mute: bool = False
    """Obeys, but its answers are lost."""
    stuck: bool = False
    frozen: bool = False
    extra_bits: int = 0
    delay: float = 0.0002
    received: tuple[int, int] | None = None
    latched: int | None = None
    targets: list[int] = field(default_factory=list)
    """Targets latched while operation was enabled."""
    controlwords: list[int] = field(default_factory=list)

    def sync(self) -> None:
        """Reach the last target, latch the next one, obey the controlword."""
        if self.state is State.OPERATION_ENABLED and self.latched is not None and not self.frozen:
            self.position = self.latched
        if self.received is None:
            return
        controlword, self.latched = self.received
        self.controlwords.append(controlword)
        if self.state is not State.FAULT and not self.stuck:
            if controlword & 0x02 == 0:
                self.state = State.SWITCH_ON_DISABLED
            self.state = UP.get((self.state, controlword), self.state)
        if self.state is State.OPERATION_ENABLED:
            self.targets.append(self.latched)


class FakeArm(can.BusABC):
    """A bus with scripted drives behind it.

    Args:
        nodes: node ids.
        clock: virtual time; a wait for frames moves it.
        script: called at every SYNC with its number and this arm, before the drives see it.
    """

    def __init__(
        self, nodes: tuple[int, ...], clock: Clock, script: Callable[[int, FakeArm], None] | None = None
    ) -> None:
        self.clock = clock
        self.script = script or (lambda number, arm: None)
        self.axes = [Axis(node) for node in nodes]
        self.syncs = 0
        self.sync_times: list[float] = []
        self.order: list[int] = []
        self._queue: deque[tuple[float, can.Message]] = deque()
        self._layout = tpdo_layouts(16)[0]
        self.channel_info = "fake"
        super().__init__("fake")

    def put(self, cob_id: int, data: bytes, delay: float = 0.0) -> None:
        """A frame that arrives after a delay."""
        message = can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)
        self._queue.append((self.clock.now + delay, message))
        self._queue = deque(sorted(self._queue, key=lambda item: item[0]))

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self.order.append(msg.arbitration_id)
        if msg.arbitration_id == 0x080:
            self._sync()
            return
        for axis in self.axes:
            if msg.arbitration_id == 0x200 + axis.node:
                axis.received = RPDO.unpack(msg.data)

    def _sync(self) -> None:
        self.script(self.syncs, self)
        self.syncs += 1
        self.sync_times.append(self.clock.now)
        for axis in self.axes:
            if not axis.silent:
                axis.sync()
            if not axis.silent and not axis.mute:
                word = WORDS[axis.state] | axis.extra_bits
                self.put(0x180 + axis.node, self._layout.pack(word, axis.position, axis.node), axis.delay)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        # Not _recv_internal: BusABC.recv repeats it until the timeout has passed on the real clock.
        assert timeout is not None
        if self._queue and self._queue[0][0] <= self.clock.now + timeout:
            due, message = self._queue.popleft()
            self.clock.now = max(self.clock.now, due)
            return message
        self.clock.now += timeout
        return None

    def fail(self, axis: int, code: int) -> None:
        """A drive's own fault, with its EMCY."""
        self.axes[axis].state = State.FAULT
        self.put(0x080 + self.axes[axis].node, code.to_bytes(2, "little") + bytes(6))
