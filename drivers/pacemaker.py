"""Absolute deadlines of the SYNC: never a burst to catch up, every skipped deadline counted."""

from __future__ import annotations

import time
from collections.abc import Callable

LATE_SHARE = 0.5
"""A SYNC is late when sent after more than this share of the period."""


class Pacemaker:
    """Waits for one deadline after the other.

    Args:
        period: s.
        clock: monotonic time, s.
        sleep: waits that many seconds.
    """

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.period = period
        self.missed_now = 0
        """Deadlines skipped just before the present one."""
        self.late_now = False
        self._clock = clock
        self._sleep = sleep
        self._start = 0.0
        self._index = 0
        self.restart()

    def restart(self) -> None:
        """Let the next deadline be one period from now."""
        self._start = self._clock()
        self._index = 0

    @property
    def deadline(self) -> float:
        """The present deadline, s on the clock."""
        return self._start + self._index * self.period

    def wait(self) -> float:
        """Wait for the next deadline.

        Returns:
            Lateness: s from the deadline that follows the previous one. Where that is more than a
            period, the deadlines gone by are skipped; the cycle then runs at the latest of them.
        """
        self._index += 1
        due = self.deadline
        while (left := due - self._clock()) > 0:
            self._sleep(left)
        lateness = self._clock() - due
        self.missed_now = int(lateness // self.period)
        self._index += self.missed_now
        self.late_now = lateness - self.missed_now * self.period > LATE_SHARE * self.period
        return lateness
