"""Node guarding and life guarding of one simulated drive (CiA 301, 7.2.8.2.1; objects 100Ch and 100Dh)."""

from __future__ import annotations

from drivers.simulated.object_dictionary import ObjectDictionary

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
