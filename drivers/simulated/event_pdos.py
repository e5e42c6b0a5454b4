"""TPDOs of a simulated drive that need more than a SYNC: types 0 and 252 to 255 (CiA 301, 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.bus.ports import Frame
from drivers.simulated.pdo import Pdo

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
