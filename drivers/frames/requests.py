"""How a stream is asked to pause or to end, from any thread."""

from __future__ import annotations

import threading

from drivers.frames.ring import Request, Ring


class StreamControl:
    """Requests to a stream, from any thread and at any time; what comes before the stream counts for it.

    One object serves one stream. Every request also ends a pause, except a pause itself.

    Args:
        abort_event: an event that means :meth:`abort` once it is set; for callers that have one already.
    """

    def __init__(self, abort_event: threading.Event | None = None) -> None:
        self._event = abort_event
        # Reentrant: a signal handler may interrupt its own thread in here.
        self._lock = threading.RLock()
        self._ring: Ring | None = None
        self._standing: dict[Request, str] = {}

    def pause(self, reason: str = "pause requested") -> None:
        """Come to rest now, along the path, and hold there."""
        self._ask(Request.PAUSE, reason)

    def pause_after(self, reason: str = "pause requested") -> None:
        """Finish the period, then come to rest along the path and hold there."""
        self._ask(Request.PAUSE_AFTER, reason)

    def resume(self) -> None:
        """Go on after a pause, or take back one that has not begun."""
        with self._lock:
            for pause in (Request.PAUSE, Request.PAUSE_AFTER):
                self._standing.pop(pause, None)
            if self._ring is not None:
                self._ring.resume()

    def stop(self, reason: str = "stop requested") -> None:
        """Finish the period, then come to rest and disable."""
        self._ask(Request.STOP, reason)

    def abort(self, reason: str = "abort requested") -> None:
        """Come to rest now on a ramp, then disable."""
        self._ask(Request.ABORT, reason)

    def halt(self, reason: str = "halt requested") -> None:
        """Quick stop now (605Ah), then disable."""
        self._ask(Request.HALT, reason)

    @property
    def reason(self) -> str | None:
        """Of the most urgent request to end; None where there is none. A pause is none."""
        with self._lock:
            ends = [request for request in self._standing if request >= Request.STOP]
            return self._standing[max(ends)] if ends else None

    def poll(self) -> None:
        """Look at the event; called while the stream runs."""
        if self._event is not None and self._event.is_set():
            self.abort("stop requested")

    def attach(self, ring: Ring) -> None:
        """Let requests reach a running stream; those made before reach it now."""
        with self._lock:
            self._ring = ring
            for request in self._standing:
                ring.request(request)

    def detach(self) -> None:
        """The stream is over."""
        with self._lock:
            self._ring = None

    def _ask(self, request: Request, reason: str) -> None:
        with self._lock:
            self._standing.setdefault(request, reason)
            if self._ring is not None:
                self._ring.request(request)
