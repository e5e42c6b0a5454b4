"""The PDOs of one drive: what waits for the next SYNC, how long none has come, what goes out after one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers.bus.ports import Frame
from drivers.simulated.object_dictionary import ObjectDictionary
from drivers.simulated.pdo import Pdo
from drivers.simulated.quirks import STANDARD, Quirks

_ACYCLIC, _SAMPLED = 0, 252
_INHIBIT, _TIMER = 3, 5


class EventPdos:
    """When each goes out, and with what; times are s of a monotonic clock.

    A type 0 goes out at a SYNC where its values have changed; 252 is sampled at the SYNC and 253 when asked,
    both sent to a remote frame; 254 and 255 go out when a value has changed or the event timer (1800:05) is
    over, no sooner than the inhibit time (1800:03) allows.

    Args:
        tpdos: of one drive.
    """

    def __init__(self, tpdos: Sequence[Pdo]) -> None:
        self._tpdos = tpdos
        self._told: dict[int, bytes] = {}
        """By COB-ID: what was sent last."""
        self._at: dict[int, float] = {}
        """By COB-ID: when that was."""
        self._sampled: dict[int, bytes] = {}

    def begin(self) -> None:
        """NMT operational begins: everything is new."""
        self._told.clear()
        self._at.clear()
        self._sampled.clear()

    def at_sync(self, pdo: Pdo) -> list[Frame]:
        """What a TPDO of such a type does at a SYNC."""
        data = pdo.pack()
        if pdo.transmission_type == _SAMPLED:
            self._sampled[pdo.cob_id] = data
        if pdo.transmission_type != _ACYCLIC or self._told.get(pdo.cob_id) == data:
            return []
        self._told[pdo.cob_id] = data
        return [(pdo.cob_id, data)]

    def due(self, now: float) -> list[Frame]:
        """TPDOs that go out by themselves now."""
        frames = []
        for pdo in self._tpdos:
            if not pdo.event_driven:
                continue
            data, last = pdo.pack(), self._at.get(pdo.cob_id, float("-inf"))
            timer = pdo.milliseconds(_TIMER)
            asked = data != self._told.get(pdo.cob_id) or (timer > 0 and now >= last + timer)
            if asked and now >= last + pdo.milliseconds(_INHIBIT):
                self._told[pdo.cob_id], self._at[pdo.cob_id] = data, now
                frames.append((pdo.cob_id, data))
        return frames

    def next_event(self) -> float:
        """When :meth:`due` may have something by time alone."""
        times = [float("inf")]
        for pdo in self._tpdos:
            if not pdo.event_driven:
                continue
            last, timer = self._at.get(pdo.cob_id), pdo.milliseconds(_TIMER)
            if last is None:
                return float("-inf")
            if pdo.pack() != self._told[pdo.cob_id]:
                times.append(last + pdo.milliseconds(_INHIBIT))
            if timer > 0:
                times.append(last + max(timer, pdo.milliseconds(_INHIBIT)))
        return min(times)

    def asked_for(self, cob_id: int) -> list[Frame]:
        """The answer to a remote frame."""
        for pdo in self._tpdos:
            if pdo.valid and pdo.cob_id == cob_id and pdo.remote_allowed:
                data = self._sampled.get(cob_id) if pdo.transmission_type == _SAMPLED else pdo.pack()
                return [] if data is None else [(cob_id, data)]
        return []


LAST_CYCLIC_TYPE = 240
"""Transmission types from 1 to this say at each how manieth SYNC a TPDO goes out."""


class ProcessData:
    """One RPDO and the TPDOs.

    Args:
        dictionary: has their parameters.
        has_torque: whether the drive has torque, and so the mapping is fixed.
        quirks: what this kind of drive does otherwise.
    """

    def __init__(
        self, dictionary: ObjectDictionary, has_torque: Callable[[], bool], quirks: Quirks = STANDARD
    ) -> None:
        self._dictionary = dictionary
        self.rpdo = Pdo(dictionary, 0x1400, 0x1600, True, has_torque, quirks)
        self.tpdos = tuple(
            Pdo(dictionary, 0x1800 + number, 0x1A00 + number, False, has_torque, quirks)
            for number in range(quirks.tpdos)
        )
        self.tpdo, self.second_tpdo = self.tpdos[:2]
        self.events = EventPdos(self.tpdos)
        """TPDOs that do not go out at every so-manieth SYNC."""
        self._waiting: bytes | None = None
        self._age = 0.0
        self._syncs = 0

    def receive(self, data: bytes) -> bytes | None:
        """An RPDO: kept for the next SYNC where it is synchronous, else given back to be taken at once."""
        if not self.rpdo.synchronous:
            return data
        self._waiting = data
        return None

    def drop(self) -> None:
        """Forgets what would have been latched next: a frame lost on the bus."""
        self._waiting = None

    def delay(self) -> bytes | None:
        """What would have been latched now, to be given back after the SYNC: a frame that came too late."""
        late, self._waiting = self._waiting, None
        return late

    def latch(self, sync_period: float) -> bytes | None:
        """A SYNC: what came before it, to be taken now.

        Args:
            sync_period: the period that this SYNC stands for, s.
        """
        self._age += sync_period
        return self.delay()

    def unpack(self, data: bytes) -> bool:
        """Write the objects of an RPDO; False where its length does not fit."""
        if not self.rpdo.unpack(data):
            return False
        self.restart()
        return True

    def restart(self) -> None:
        """The deadline (1400:05) begins anew."""
        self._age = 0.0

    @property
    def overdue(self) -> bool:
        """Whether no RPDO has come for longer than the deadline."""
        return 0 < self._dictionary.integer(0x1400, 5) / 1000.0 < self._age

    @property
    def sets_target(self) -> bool:
        """Whether the RPDO carries a target."""
        return self.rpdo.maps(0x607A) or self.rpdo.maps(0x60C1)

    @property
    def commands(self) -> bool:
        """Whether the RPDO carries the controlword."""
        return self.rpdo.maps(0x6040)

    def count_sync(self) -> None:
        """A SYNC that may be answered."""
        self._syncs += 1

    def frames(self) -> list[Frame]:
        """The TPDOs that belong to the latest SYNC: COB-ID and payload."""
        frames = []
        for pdo in self.tpdos:
            every = pdo.transmission_type
            if not pdo.valid:
                continue
            if not 0 < every <= LAST_CYCLIC_TYPE:
                frames += self.events.at_sync(pdo)
            elif self._syncs % every == 0:
                frames.append((pdo.cob_id, pdo.pack()))
        return frames
