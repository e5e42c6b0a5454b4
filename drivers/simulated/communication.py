"""What one simulated drive says and hears besides its power states: SDO, PDO, heartbeats, guarding."""

from __future__ import annotations

from collections.abc import Callable

from drivers.bus.ports import Frame
from drivers.simulated.heartbeats import Heartbeats, Nmt
from drivers.simulated.object_dictionary import ObjectDictionary
from drivers.simulated.process_data import ProcessData
from drivers.simulated.quirks import Quirks
from drivers.simulated.sdo_server import SdoServer

_TOGGLE = 0x80


class NodeGuarding:
    """Answers guarding requests, and misses a master that has guarded it; times are s of a monotonic clock.

    A node that sends heartbeats (1017h is not 0) is not guarded.

    Args:
        dictionary: has 100Ch, 100Dh and 1017h.
    """

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self._dictionary = dictionary
        self._toggle = 0
        self._due: float | None = None

    @property
    def _life_time(self) -> float:
        return self._dictionary.integer(0x100C) * self._dictionary.integer(0x100D) / 1000.0

    def answer(self, state: int, now: float) -> bytes | None:
        """The answer to a request: NMT state with a bit that changes each time.

        The first request begins the life time, which every further one begins anew.
        """
        if self._dictionary.integer(0x1017):
            return None
        word, self._toggle = state | self._toggle, self._toggle ^ _TOGGLE
        self._due = now + self._life_time if self._life_time > 0 else None
        return bytes([word])

    def next_event(self) -> float:
        """When the life time is over."""
        return float("inf") if self._due is None else self._due

    def is_missed(self, now: float) -> bool:
        """Whether no request has come for a life time; true once for each time."""
        if self._due is None or now < self._due:
            return False
        self._due = None
        return True


class Communication:
    """The services of one node; times are s of a monotonic clock.

    Args:
        dictionary: of the node.
        node_id: its own.
        has_torque: whether the drive has torque, and so its mapping is fixed.
        quirks: what this kind of drive does otherwise.
    """

    def __init__(
        self, dictionary: ObjectDictionary, node_id: int, has_torque: Callable[[], bool], quirks: Quirks
    ) -> None:
        self.process_data = ProcessData(dictionary, has_torque, quirks)
        self.heartbeats = Heartbeats(dictionary)
        self.guarding = NodeGuarding(dictionary)
        self._sdo = SdoServer(dictionary, sized=not quirks.unsized)
        self._node_id = node_id

    def change_state(self) -> None:
        """An NMT command was obeyed: transfers under way are forgotten, event-driven TPDOs begin anew."""
        self._sdo.reset()
        self.process_data.events.begin()

    def next_event(self, nmt: Nmt) -> float:
        """When time alone brings something next."""
        due = min(self.heartbeats.next_event(), self.guarding.next_event())
        return min(due, self.process_data.events.next_event()) if nmt is Nmt.OPERATIONAL else due

    def due(self, nmt: Nmt, now: float) -> list[Frame]:
        """Frames that go out by themselves: the own heartbeat, TPDOs by event and by timer."""
        own = [(0x700 + self._node_id, bytes([nmt]))] if self.heartbeats.own_is_due(now) else []
        return own + self.process_data.events.due(now) if nmt is Nmt.OPERATIONAL else own

    def misses_master(self, now: float) -> bool:
        """Whether the master's heartbeat or its guarding has stayed away; true once for each time."""
        return self.heartbeats.master_is_missed(now) or self.guarding.is_missed(now)

    def answer_remote(self, cob_id: int, nmt: Nmt, now: float) -> list[Frame]:
        """To a remote frame: guarding, or a TPDO that is asked for."""
        if cob_id == 0x700 + self._node_id:
            word = self.guarding.answer(nmt, now)
            return [] if word is None else [(cob_id, word)]
        return self.process_data.events.asked_for(cob_id) if nmt is Nmt.OPERATIONAL else []

    def answer_sdo(self, request: bytes, nmt: Nmt) -> list[Frame]:
        """To an SDO request; none is answered in STOPPED."""
        if nmt is Nmt.STOPPED:
            return []
        return [(0x580 + self._node_id, response) for response in self._sdo.answer(request)]
