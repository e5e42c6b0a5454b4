"""The states of a session and how one leads to another; the words are bluesky's.

bluesky's RunEngine is idle, runs, and leaves a run in four ways: a pause that may be resumed, a stop (the
plan ends in order, the run counts), an abort (the plan ends now, the run is marked) and a halt (nothing more
is done than what keeps the machine safe). Here a pause comes to rest along the path now or after the period,
a stop takes effect where a period of the motion ends, an abort is a controlled ramp to standstill now, and a
halt is the drives' quick stop.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Literal

import numpy as np

from drivers import Samples, StreamControl


class SessionState(StrEnum):
    """What a session is doing."""

    IDLE = "idle"
    """Before a stream and after it."""
    RUNNING = "running"
    PAUSING = "pausing"
    """On the way to rest, along the path."""
    PAUSING_AFTER = "pausing after this pass"
    """The period is finished first."""
    PAUSED = "paused"
    """At rest on the path, holding."""
    STOPPING = "stopping"
    """The period is finished first."""
    ABORTING = "aborting"
    HALTING = "halting"


Wish = Literal["pause", "pause_after", "resume", "stop", "abort", "halt"]

_S = SessionState
TRANSITIONS: Mapping[SessionState, Mapping[Wish, SessionState]] = {
    _S.IDLE: {"stop": _S.STOPPING, "abort": _S.ABORTING, "halt": _S.HALTING},
    _S.RUNNING: {
        "pause": _S.PAUSING,
        "pause_after": _S.PAUSING_AFTER,
        "stop": _S.STOPPING,
        "abort": _S.ABORTING,
        "halt": _S.HALTING,
    },
    _S.PAUSING_AFTER: {
        "pause": _S.PAUSING,
        "resume": _S.RUNNING,
        "stop": _S.STOPPING,
        "abort": _S.ABORTING,
        "halt": _S.HALTING,
    },
    _S.PAUSING: {
        "resume": _S.RUNNING,
        "stop": _S.STOPPING,
        "abort": _S.ABORTING,
        "halt": _S.HALTING,
    },
    _S.PAUSED: {"resume": _S.RUNNING, "stop": _S.STOPPING, "abort": _S.ABORTING, "halt": _S.HALTING},
    _S.STOPPING: {"abort": _S.ABORTING, "halt": _S.HALTING},
    _S.ABORTING: {"halt": _S.HALTING},
    _S.HALTING: {},
}
"""Which wish is followed in which state; no other is: nothing takes back a stop, an abort or a halt.

An end that is wished for before the stream counts for it: whoever presses a key between the yes and the first
torque means it.
"""

REST_SECONDS = 0.4
"""Without a new sample for so long, a session that was to pause is at rest: they come every 0.05 s."""


class Conduct:
    """One stream under way: takes wishes from any thread, knows the state, passes requests on.

    Args:
        control: of the stream.
        clock: monotonic time, s.
    """

    def __init__(
        self, control: StreamControl | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.control = control or StreamControl()
        self._clock = clock
        # Reentrant: a signal handler may interrupt its own thread in here.
        self._lock = threading.RLock()
        self._state = SessionState.IDLE
        self._ended = False
        self._last_sample = 0.0

    @property
    def state(self) -> SessionState:
        """What the session is doing now."""
        with self._lock:
            pausing = self._state in (SessionState.PAUSING, SessionState.PAUSING_AFTER)
            if pausing and self._clock() - self._last_sample > REST_SECONDS:
                self._state = SessionState.PAUSED
            return self._state

    def begin(self) -> None:
        """The stream is about to start."""
        with self._lock:
            if self._state is SessionState.IDLE:
                self._state = SessionState.RUNNING
            self._last_sample = self._clock()

    def on_samples(self, samples: Samples) -> None:
        """Samples have come, so the arm is not at rest."""
        if not len(samples):
            return
        with self._lock:
            self._last_sample = self._clock()
            if self._state is SessionState.PAUSED:
                self._state = SessionState.PAUSING  # they were on their way while it came to rest

    def end(self) -> None:
        """The stream is over."""
        with self._lock:
            self._state = SessionState.IDLE
            self._ended = True

    def wish(self, wish: Wish, reason: str = "") -> bool:
        """Follow a wish, if the state allows it; False where it does not.

        Args:
            wish: what to do.
            reason: who wants it or why, for the record.
        """
        with self._lock:
            following = TRANSITIONS[self.state].get(wish)
            if following is None or self._ended:
                return False
            self._state = following
            self._last_sample = self._clock()
        if wish == "resume":
            self.control.resume()
        else:
            {
                "pause": self.control.pause,
                "pause_after": self.control.pause_after,
                "stop": self.control.stop,
                "abort": self.control.abort,
                "halt": self.control.halt,
            }[wish](reason or f"{wish} requested")
        return True


def wishes(state: SessionState) -> tuple[Wish, ...]:
    """What may be wished for in a state."""
    return tuple(TRANSITIONS[state])


def late(samples: Samples, period: float) -> int:
    """How many of the samples' SYNCs came after a missed deadline."""
    return int(np.count_nonzero(samples.lateness > period))
