"""Time since 1970 that only goes forward: the host's clock once, and the monotonic clock from there on.

The host's clock may be set while an arm is driven, by hand or by NTP, by hours and in either direction. What
is recorded then must stay in order and as long as it was; how late it is called by the clock matters less.
"""

from __future__ import annotations

import time
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

STEP = 1_000_000
"""ns between the host's clock and the monotonic one that count as a step: reading both takes some time."""
OLDEST = 10_000_000_000
"""ns that a frame may wait to be fetched."""


class SteadyClock:
    """The clock of one recording, or of one run: right when it is made, and steady afterwards."""

    def __init__(self) -> None:
        self._first = self._offset = self._before = _offset()
        self._newest = -(1 << 62)

    def now(self) -> int:
        """ns since the epoch."""
        return time.monotonic_ns() + self._first

    def moment(self) -> datetime:
        """The time, UTC."""
        return datetime.fromtimestamp(self.now() // 1000 * 1e-6, tz=UTC)

    def steady(self, stamps: NDArray[np.int64]) -> NDArray[np.int64]:
        """Stamps of the host's clock in terms of this one.

        Args:
            stamps: (N,) ns since the epoch in the order of their arrival, a few seconds old at most.

        Returns:
            (N,) ns, never less than one before, of this call or an earlier one.
        """
        offset = _offset()
        if abs(offset - self._offset) > STEP:
            self._before, self._offset = self._offset, offset
        # Without a step all are the same. After one, frames of both settings may still wait to be fetched.
        passed = stamps - self._first
        for setting in (self._before, self._offset) if self._offset != self._first else ():
            then = stamps - setting
            now = time.monotonic_ns()
            passed = np.where((then > now - OLDEST) & (then <= now + STEP), then, passed)
        found = np.maximum(np.maximum.accumulate(passed + self._first), self._newest)
        if len(found):
            self._newest = int(found[-1])
        return np.asarray(found, dtype=np.int64)


def _offset() -> int:
    """ns from the monotonic clock to the host's."""
    return time.time_ns() - time.monotonic_ns()
