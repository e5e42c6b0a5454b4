"""The last seconds at full rate, always: kept as a capture of their own when something goes wrong.

A recorder keeps a run. This keeps what nobody records: jogging, homing, an arm that stands there with its
drives talking. Samples come from whoever moves the arm, frames from a listener; either may be absent.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from daq.recording.capture import FAULT, RUN, CaptureError, Facts
from daq.recording.events import DriveEvent, EventFinder, first_fault
from daq.recording.frames import Frames
from daq.recording.listener import FrameListener
from daq.recording.recorder import Recorder
from daq.recording.steady_clock import SteadyClock
from drivers.frames.samples import Samples, StreamResult
from robots import Robot
from robots.arrays import IntArray

log = logging.getLogger(__name__)

BEFORE = 10.0
"""s that are kept before a fault."""
AFTER = 2.0
"""s that are kept after it: how the arm came to rest, and what the other drives did."""
_LOOK = 0.2
"""s between two looks whether the time after a fault is over; the bus may have fallen silent."""
_ENDED_BADLY = ("fault", "aborted")


@dataclass(frozen=True)
class _Trigger:
    reason: str
    stamp: int
    """ns since the epoch."""
    due: float
    """When to write, s on the monotonic clock."""


class FaultRing:
    """Keeps the last seconds, and writes a capture on a fault. Use as a context manager.

    What triggers it: an emergency, a drive in fault, a bus that fails, a stream that ended by itself
    (:meth:`ended`), or whoever calls :meth:`trigger`. Faults within the time after one belong to it.

    Args:
        folder: for the captures, ``fault-<time>.mcap``; made when there is one.
        robot: the arm.
        facts: metadata records by name, as for a recorder.
        listener: brings the raw frames.
        before, after: s.
    """

    def __init__(
        self,
        folder: Path,
        robot: Robot,
        facts: Mapping[str, Facts],
        listener: FrameListener | None = None,
        *,
        before: float = BEFORE,
        after: float = AFTER,
    ) -> None:
        self.captures: list[Path] = []
        """What has been written so far."""
        self._folder, self._robot, self._facts = folder, robot, dict(facts)
        self._listener = listener
        self._clock = SteadyClock() if listener is None else listener.clock
        self._before, self._after = before, after
        self._period = float(self._facts[RUN]["period"])
        self._finder = EventFinder(robot)
        self._samples: deque[tuple[IntArray, Samples]] = deque()
        self._frames: deque[Frames] = deque()
        self._origin: int | None = None
        """Time of the cycle that counts as 0, ns; of the first stream."""
        self._start = 0
        """Time of cycle 0 of the stream that runs."""
        self._last_cycle = -1
        self._trigger: _Trigger | None = None
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._writing = threading.Thread(target=self._write_when_due, name="fault-ring", daemon=True)
        self._writing.start()
        if listener is not None:
            listener.subscribe(self.write_frames)

    # What comes in --------------------------------------------------------------------------

    def write(self, samples: Samples) -> None:
        """Take samples of a stream; cycle numbers that begin anew are another stream."""
        if not len(samples):
            return
        with self._lock:
            numbered, stamps = self._numbered(samples)
            self._samples.append((stamps, numbered))
            self._look(first_fault(self._finder.in_samples(samples, stamps)))
            self._forget(int(stamps[-1]))

    def write_frames(self, frames: Frames) -> None:
        """Take raw frames."""
        if not len(frames):
            return
        with self._lock:
            self._frames.append(frames)
            self._look(first_fault(self._finder.in_frames(frames)))
            self._forget(int(frames.stamp[-1]))

    def ended(self, result: StreamResult) -> None:
        """Take note of how a stream ended; one that ended by itself is a fault."""
        if result.outcome in _ENDED_BADLY:
            self.trigger(result.reason)

    def trigger(self, reason: str) -> None:
        """Keep what is there now and what comes in the time after."""
        with self._lock:
            self._note(reason, self._clock.now())

    def _numbered(self, samples: Samples) -> tuple[Samples, IntArray]:
        """Samples numbered from the first stream on, and their times.

        The numbers of a later stream go on where its time puts them: what lies between is a gap.
        """
        if samples.cycle[0] <= self._last_cycle or self._origin is None:
            self._start = self._clock.now() - round(samples.time[-1] * 1e9)
        if self._origin is None:
            self._origin = self._start
        self._last_cycle = int(samples.cycle[-1])
        stamps = self._start + np.round(samples.time * 1e9).astype(np.int64)
        shift = round((self._start - self._origin) * 1e-9 / self._period)
        cycle = samples.cycle + shift
        return replace(samples, cycle=cycle, time=np.asarray(cycle * self._period, dtype=np.float64)), stamps

    def _look(self, fault: DriveEvent | None) -> None:
        if fault is not None:
            self._note(f"{fault.joint}: {fault.text}", fault.stamp)

    def _note(self, reason: str, stamp: int) -> None:
        if self._trigger is None:
            log.warning("fault: %s; %g s around it are kept", reason, self._before + self._after)
            self._trigger = _Trigger(reason, stamp, time.monotonic() + self._after)

    def _forget(self, now: int) -> None:
        """Drop what is older than the time before a fault; after one, nothing that belongs to it."""
        newest = now if self._trigger is None else min(now, self._trigger.stamp)
        oldest = newest - round(self._before * 1e9)
        while self._samples and self._samples[0][0][-1] < oldest:
            self._samples.popleft()
        while self._frames and self._frames[0].stamp[-1] < oldest:
            self._frames.popleft()

    # What goes out --------------------------------------------------------------------------

    def _write_when_due(self) -> None:
        while not self._ended.wait(_LOOK):
            if self._trigger is not None and time.monotonic() >= self._trigger.due:
                self._write_out()

    def _write_out(self) -> None:
        """Write the capture; what fails here must end nothing else."""
        with self._lock:
            trigger, self._trigger = self._trigger, None
            samples, frames = list(self._samples), list(self._frames)
            origin = self._origin or 0
        if trigger is None:
            return
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            path = self._path(trigger.stamp)
            self._write_capture(path, trigger, origin, samples, frames)
            self.captures.append(path)
            log.warning("fault: %s: kept in %s", trigger.reason, path)
        except (CaptureError, OSError) as error:
            log.error("fault: %s: cannot be kept: %s", trigger.reason, error)

    def _path(self, stamp: int) -> Path:
        moment = datetime.fromtimestamp(stamp // 10**9, tz=UTC)
        name = f"fault-{moment:%Y%m%d-%H%M%S}-{stamp % 10**9 // 10**6:03d}"
        found = [self._folder / f"{name}{suffix}.mcap" for suffix in ("", *(f"-{k}" for k in range(2, 100)))]
        return next(path for path in found if not path.exists())

    def _write_capture(
        self,
        path: Path,
        trigger: _Trigger,
        origin: int,
        samples: list[tuple[IntArray, Samples]],
        frames: list[Frames],
    ) -> None:
        told = {
            "reason": trigger.reason,
            "time": str(trigger.stamp),
            "before": repr(self._before),
            "after": repr(self._after),
        }
        with Recorder(path, self._robot, {**self._facts, FAULT: told}, start_ns=origin) as recorder:
            for _, batch in samples:
                recorder.write(batch)
            for heard in frames:
                recorder.write_frames(heard)
            cycles = int(samples[-1][1].cycle[-1]) + 1 if samples else 0
            outcome = {"outcome": "fault", "reason": trigger.reason, "cycles": str(cycles)}
            recorder.finish({**outcome, "frames": str(sum(map(len, frames)))})

    def close(self) -> None:
        """End; where there has been a fault, after the time that belongs to it."""
        trigger = self._trigger
        if self._listener is not None and trigger is not None:
            time.sleep(max(0.0, trigger.due - time.monotonic()))
        if self._listener is not None:
            self._listener.unsubscribe(self.write_frames)
        self._ended.set()
        self._writing.join()
        self._write_out()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
