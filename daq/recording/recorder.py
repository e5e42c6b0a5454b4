"""Write a run into one MCAP file that survives the death of its writer.

The file holds channels of ROS 2 CDR messages and metadata records; docs/reference/capture-format.md
describes it. A chunk is closed with nearly every batch of samples, so a killed process loses no more than
what its operating system had not been handed yet; a thread of its own calls fdatasync every 0.25 s, so a
power cut loses little more.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from daq.recording.capture import CHECKSUM_KEY, OUTCOME, PROFILE, CaptureError, Facts, facts_checksum
from daq.recording.events import DriveEvent, EventFinder
from daq.recording.frames import Frames
from daq.recording.joint_channels import channel_rows
from daq.recording.link_messages import LinkMessages
from daq.recording.listener import FrameListener
from daq.recording.mcap_file import McapFile, Rows
from daq.recording.sample_messages import SampleMessages
from daq.recording.steady_clock import SteadyClock
from daq.recording.temperatures import Temperature
from daq.recording.topics import (
    BESIDE_TOPIC,
    CHANNELS,
    EVENTS_TOPIC,
    FRAMES_TOPIC,
    NUMBERS,
    TEMPERATURE_TOPIC,
    TOPICS,
)
from drivers.frames.samples import Samples
from robots import Robot
from robots.arrays import FloatArray

log = logging.getLogger(__name__)

FLUSH_INTERVAL = 0.04
"""Shorter than the time between two batches of samples, so that each is handed over as it comes, s."""
SYNC_INTERVAL = 0.25


class Recorder:
    """Records one run. Use as a context manager; ``finish`` states the outcome.

    Raises:
        CaptureError: the file exists already, or cannot be written.
    """

    def __init__(
        self,
        path: Path,
        robot: Robot,
        facts: Mapping[str, Facts],
        *,
        start_ns: int | None = None,
        listener: FrameListener | None = None,
        reference: bool = True,
    ) -> None:
        """Open the file and write what is known before the first sample.

        Args:
            path: the new file.
            robot: the arm; its gains give the torque channel.
            facts: metadata records by name, see ``daq.recording.run_facts``.
            start_ns: time of cycle 0, ns since the epoch; where absent, from the clock at the first samples.
            listener: brings the raw frames; without one there are none.
            reference: whether the samples have a reference; logs of others may have none.
        """
        self.path = path
        self._messages = SampleMessages(robot, reference=reference)
        self._links = LinkMessages(robot)
        self._joints = [joint.name for joint in robot.joint]
        self._events = EventFinder(robot)
        self._start_ns = start_ns
        self._listener = listener
        self.clock = SteadyClock() if listener is None else listener.clock
        """Of everything that is recorded."""
        self._counts = dict.fromkeys(CHANNELS, 0)
        self._newest = dict.fromkeys(CHANNELS, 0)
        """Log times."""
        self._lock = threading.Lock()
        self._failure: OSError | None = None
        self._last_flush = time.monotonic()
        self._closed = threading.Event()
        try:
            self._file = path.open("x+b")
        except FileExistsError:
            raise CaptureError(f"{path}: exists already; a capture is never changed or overwritten") from None
        except OSError as error:
            raise CaptureError(f"{path}: cannot be written: {error.strerror}") from error
        self._begin(facts)
        self._syncing = threading.Thread(target=self._sync_until_closed, name="capture-sync", daemon=True)
        self._syncing.start()
        if listener is not None:
            listener.subscribe(self.write_frames)

    def _begin(self, facts: Mapping[str, Facts]) -> None:
        try:
            self._writer = McapFile(self._file, PROFILE, "armhil", TOPICS)
            for name, record in facts.items():
                self._add_facts(name, record)
            self._writer.flush()
        except OSError as error:
            self._close_file()
            raise CaptureError(f"{self.path}: cannot be written: {error.strerror}") from error

    def _add_facts(self, name: str, record: Facts) -> None:
        """Write a record twice: without it samples have no meaning, and one bad sector takes one copy."""
        for _ in range(2):
            self._writer.add_metadata(name, {**record, CHECKSUM_KEY: facts_checksum(record)})

    def write(self, samples: Samples, beside: Mapping[str, FloatArray] | None = None) -> None:
        """Append samples; joint torques and following errors are derived from them (eq. 5).

        Args:
            samples: N cycles.
            beside: further channels of the joints (``daq.recording.joint_channels``).

        Raises:
            CaptureError: the disk is full or gone; what was written before stays readable.
        """
        if not len(samples):
            return
        if self._start_ns is None:
            self._start_ns = self.clock.now() - round(samples.time[-1] * 1e9)
        stamps = self._start_ns + np.round(samples.time * 1e9).astype(np.int64)
        streams = self._messages.rows(samples, stamps)
        if beside:
            streams[BESIDE_TOPIC] = channel_rows(self._joints, stamps, beside)
        sequences = (samples.cycle & 0xFFFFFFFF).astype(np.uint32)
        with self._lock:
            self._raise_failure()
            self._attempt(streams, sequences, stamps, self._events.in_samples(samples, stamps))
            for batch in self._links.batches(samples, stamps):
                self._attempt(*batch, ())
            self._raise_failure()

    def write_frames(self, frames: Frames) -> None:
        """Append raw frames, and the events that they tell. A disk that fails is told at the next samples."""
        with self._lock:
            if self._failure is not None or self._closed.is_set():
                return
            begin = self._counts[NUMBERS[FRAMES_TOPIC]]
            sequences = np.arange(begin, begin + len(frames), dtype=np.uint64).astype(np.uint32)
            streams = {FRAMES_TOPIC: frames.rows()}
            self._attempt(streams, sequences, frames.stamp, self._events.in_frames(frames))

    def write_temperatures(self, temperatures: Sequence[Temperature]) -> None:
        """Append readings of the drives' temperatures.

        Raises:
            CaptureError: as for :meth:`write`.
        """
        with self._lock:
            self._raise_failure()
            try:
                for reading in temperatures:
                    self._append_one(TEMPERATURE_TOPIC, reading.stamp, reading.encode())
            except OSError as error:
                self._failure = error
            self._raise_failure()

    @property
    def counts(self) -> dict[str, int]:
        """Messages so far, by topic."""
        return {CHANNELS[number]: count for number, count in self._counts.items()}

    def _attempt(
        self,
        streams: Mapping[str, Rows],
        sequences: NDArray[np.uint32],
        stamps: NDArray[np.int64],
        events: Sequence[DriveEvent],
    ) -> None:
        try:
            for topic, rows in streams.items():
                self._writer.add(NUMBERS[topic], sequences, stamps, rows)
                self._counts[NUMBERS[topic]] += len(rows)
            for event in events:
                self._append_one(EVENTS_TOPIC, event.stamp, event.encode())
            if time.monotonic() - self._last_flush >= FLUSH_INTERVAL:
                self._flush()
        except OSError as error:
            self._failure = error

    def _append_one(self, topic: str, stamp: int, data: bytes) -> None:
        number = NUMBERS[topic]
        sequence = np.array([self._counts[number] & 0xFFFFFFFF], dtype=np.uint32)
        row = np.frombuffer(data, dtype=np.uint8)[np.newaxis]
        # What frames tell is known before what samples do; the message itself has its own time.
        self._newest[number] = max(self._newest[number], stamp)
        self._writer.add(number, sequence, np.array([self._newest[number]]), row)
        self._counts[number] += 1

    def _flush(self) -> None:
        self._writer.flush()
        self._last_flush = time.monotonic()

    def _sync_until_closed(self) -> None:
        while not self._closed.wait(SYNC_INTERVAL):
            try:
                with self._lock:
                    if self._failure is not None:
                        return
                    if time.monotonic() - self._last_flush >= FLUSH_INTERVAL:
                        self._flush()
                os.fdatasync(self._file.fileno())
            except OSError as error:
                with self._lock:
                    self._failure = error
                log.info("%s: cannot be written any further: %s", self.path, error.strerror)

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise CaptureError(
                f"{self.path}: cannot be written any further: {self._failure.strerror}; "
                "what was recorded before is readable"
            ) from self._failure

    def finish(self, outcome: Facts) -> None:
        """Write how the run ended, close the file and make it read-only.

        Raises:
            CaptureError: the end of the recording could not be written.
        """
        heard = self._stop_listening()
        self._stop_syncing()
        if self._file.closed:
            return
        self._raise_failure()
        try:
            self._add_facts(OUTCOME, {**outcome, **heard})
            self._writer.finish()
            os.fdatasync(self._file.fileno())
            os.fchmod(self._file.fileno(), 0o444)
        except OSError as error:
            self._failure = error
            self._raise_failure()
        finally:
            self._close_file()

    def _stop_listening(self) -> Facts:
        """Take the last frames; what belongs into the outcome of them."""
        if self._listener is None:
            return {}
        listener, self._listener = self._listener, None
        listener.unsubscribe(self.write_frames)
        heard = {
            "frames": str(self._counts[NUMBERS[FRAMES_TOPIC]]),
            "frames_dropped": str(listener.dropped),
        }
        return heard | ({"frames_ended": listener.failure} if listener.failure else {})

    def _close_file(self) -> None:
        try:
            self._file.close()
        except OSError as error:  # what is buffered and does not fit on a full disk
            log.info("%s: the last samples are lost: %s", self.path, error.strerror)

    def _stop_syncing(self) -> None:
        self._closed.set()
        if self._syncing is not threading.current_thread():
            self._syncing.join()

    def abandon(self) -> None:
        """Close the file without an outcome, as after an error; the samples so far are in it."""
        self._stop_listening()
        self._stop_syncing()
        if self._file.closed:
            return
        try:
            if self._failure is None:
                self._writer.flush()
        except OSError as error:
            log.info("%s: the last samples are lost: %s", self.path, error.strerror)
        finally:
            self._close_file()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.abandon()
