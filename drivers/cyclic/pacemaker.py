"""Absolute deadlines of the SYNC: never a burst to catch up, every skipped deadline counted."""

from __future__ import annotations

import time
from collections.abc import Callable

LATE_SHARE = 0.5
"""A SYNC is late when sent after more than this share of the period."""
SKIP_SHARE = 0.75
"""A SYNC is not sent at all after more than this share of the period."""


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
        self.overrun = 0.0
        """s by which the deadline was gone when the latest wait for it began."""
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

        A deadline that is gone by more than SKIP_SHARE is skipped, so that two SYNCs never come closer
        together than the rest of the period.
        Nor are later deadlines put off instead: drives lock onto the phase of the SYNC and interpolate in it.

        Returns:
            Lateness: s from the deadline that follows the previous one; above a period where some were
            skipped.
        """
        due = self.deadline + self.period
        self.overrun = self._clock() - due
        self._sleep_until(due)
        behind = max(0.0, self._clock() - due)
        self.missed_now = int(behind / self.period + 1.0 - SKIP_SHARE)
        self._index += 1 + self.missed_now
        self._sleep_until(self.deadline)
        now = self._clock()
        self.late_now = now - self.deadline > LATE_SHARE * self.period
        return now - due

    def _sleep_until(self, due: float) -> None:
        while (left := due - self._clock()) > 0:
            self._sleep(left)
