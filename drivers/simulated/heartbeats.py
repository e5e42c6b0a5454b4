"""Heartbeats of one node: its own (1017h), and those of the master that it waits for (1016h)."""

from __future__ import annotations

from enum import IntEnum

from drivers.simulated.object_dictionary import ObjectDictionary


class Nmt(IntEnum):
    """NMT states as heartbeats carry them."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class Heartbeats:
    """When to send one, and when the master's is missed; times are s of a monotonic clock.

    Args:
        dictionary: has 1016h and 1017h.
    """

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self._dictionary = dictionary
        self._next = 0.0
        self._master_due: float | None = None
        dictionary.listeners[0x1017] = lambda subindex, value: self._begin_anew()
        dictionary.listeners[0x1016] = lambda subindex, value: self.forget_master()

    @property
    def _period(self) -> float:
        return self._dictionary.integer(0x1017) / 1000.0

    def _begin_anew(self) -> None:
        """A changed period acts at once: the next heartbeat is due."""
        self._next = 0.0

    def boot(self, now: float) -> None:
        """The first one comes a period from now."""
        self._next = now + self._period

    def next_event(self) -> float:
        """When there is something to do next."""
        producer = self._next if self._period > 0 else float("inf")
        return producer if self._master_due is None else min(producer, self._master_due)

    def own_is_due(self, now: float) -> bool:
        """Whether to send one now; asked once for each."""
        period = self._period
        if period <= 0 or now < self._next:
            return False
        behind = now - self._next > period
        self._next = (now if behind else self._next) + period
        return True

    def hear(self, node: int, now: float) -> None:
        """A heartbeat of another node; the first one of the awaited node arms the watch."""
        word = self._dictionary.integer(0x1016, 1)
        if word >> 16 & 0x7F == node and word & 0xFFFF:
            self._master_due = now + (word & 0xFFFF) / 1000.0

    def master_is_missed(self, now: float) -> bool:
        """Whether the awaited heartbeat has stayed away; true once for each time."""
        if self._master_due is None or now < self._master_due:
            return False
        self._master_due = None
        return True

    def forget_master(self) -> None:
        """Waits for nobody until the next heartbeat comes."""
        self._master_due = None
