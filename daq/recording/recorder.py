"""Write a run into one MCAP file that survives the death of its writer.

The file holds three channels of ROS 2 CDR messages and metadata records; docs/reference/capture-format.md
describes it. A chunk is closed at least every 0.1 s of data, so a killed process loses no more than
what its operating system had not been handed yet; a thread of its own calls fdatasync every 0.25 s, so a
power cut loses little more.
"""

from __future__ import annotations

import logging
import os
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from mcap.writer import CompressionType, Writer

from daq.recording import messages
from daq.recording.capture import CHECKSUM_KEY, OUTCOME, PROFILE, CaptureError, Facts, facts_checksum
from drivers.cyclic.samples import Samples
from robots import Robot

log = logging.getLogger(__name__)

FLUSH_INTERVAL = 0.1
SYNC_INTERVAL = 0.25

REFERENCE_TOPIC = "/joint_reference"
MEASURED_TOPIC = "/joint_states"
STATUS_TOPIC = "/cycle_status"
# The writer numbers channels in the order of registration, so a reader knows them even where the
# chunk that introduces them is damaged.
CHANNELS = {1: REFERENCE_TOPIC, 2: MEASURED_TOPIC, 3: STATUS_TOPIC}


class Recorder:
    """Records the samples of one run. Use as a context manager; ``finish`` states the outcome.

    Raises:
        CaptureError: the file exists already, or cannot be written.
    """

    def __init__(
        self, path: Path, robot: Robot, facts: Mapping[str, Facts], *, start_ns: int | None = None
    ) -> None:
        """Open the file and write what is known before the first sample.

        Args:
            path: the new file.
            robot: the arm; its gains give the torque channel.
            facts: metadata records by name, see ``daq.identification.run_facts``.
            start_ns: time of cycle 0, ns since the epoch; now where absent.
        """
        self.path = path
        self._robot = robot
        names = [joint.name for joint in robot.joint]
        self._reference = messages.joint_state_layout(names)
        self._measured = messages.joint_state_layout(names, effort=True)
        self._status = messages.cycle_status_layout(names)
        self._start_ns = time.time_ns() if start_ns is None else start_ns
        self._lock = threading.Lock()
        self._failure: OSError | None = None
        self._last_flush = time.monotonic()
        self._closed = threading.Event()
        try:
            self._file = path.open("xb")
        except FileExistsError:
            raise CaptureError(f"{path}: exists already; a capture is never changed or overwritten") from None
        except OSError as error:
            raise CaptureError(f"{path}: cannot be written: {error.strerror}") from error
        self._writer = Writer(self._file, compression=CompressionType.ZSTD)
        self._begin(facts)
        self._syncing = threading.Thread(target=self._sync_until_closed, name="capture-sync", daemon=True)
        self._syncing.start()

    def _begin(self, facts: Mapping[str, Facts]) -> None:
        try:
            self._writer.start(profile=PROFILE, library="armhil")
            joint_state = self._writer.register_schema(
                messages.JOINT_STATE, "ros2msg", messages.JOINT_STATE_DEFINITION.encode()
            )
            status = self._writer.register_schema(
                messages.CYCLE_STATUS, "ros2msg", messages.CYCLE_STATUS_DEFINITION.encode()
            )
            for number, topic in CHANNELS.items():
                schema = status if topic == STATUS_TOPIC else joint_state
                if self._writer.register_channel(topic, "cdr", schema) != number:
                    raise AssertionError("channels are numbered in the order of registration")
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

    def write(self, samples: Samples) -> None:
        """Append samples; joint torques are derived from the control signals (eq. 5).

        Raises:
            CaptureError: the disk is full or gone; what was written before stays readable.
        """
        stamps = self._start_ns + np.round(samples.time * 1e9).astype(np.int64)
        streams = (
            self._reference.encode(stamps, {"position": samples.reference}),
            self._measured.encode(
                stamps,
                {"position": samples.position, "effort": self._robot.joint_torque(samples.control_signal)},
            ),
            self._status.encode(
                stamps,
                {
                    "cycle": samples.cycle,
                    "lateness": samples.lateness,
                    "control_signal": samples.control_signal,
                    "statusword": samples.statusword,
                    "complete": samples.complete,
                },
            ),
        )
        with self._lock:
            self._raise_failure()
            try:
                self._append(streams, stamps.tolist(), samples.cycle.tolist())
            except OSError as error:
                self._failure = error
                self._raise_failure()

    def _append(self, streams: tuple[list[bytes], ...], stamps: list[int], cycles: list[int]) -> None:
        add = self._writer.add_message
        for stamp, cycle, *row in zip(stamps, cycles, *streams, strict=True):
            for channel, data in enumerate(row, start=1):
                add(channel, stamp, data, stamp, cycle & 0xFFFFFFFF)
        if time.monotonic() - self._last_flush >= FLUSH_INTERVAL:
            self._flush()

    def _flush(self) -> None:
        self._writer.flush()
        self._last_flush = time.monotonic()

    def _sync_until_closed(self) -> None:
        while not self._closed.wait(SYNC_INTERVAL):
            try:
                with self._lock:
                    if self._failure is not None:
                        return
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
        self._stop_syncing()
        if self._file.closed:
            return
        self._raise_failure()
        try:
            self._add_facts(OUTCOME, outcome)
            self._writer.finish()
            self._file.flush()
            os.fdatasync(self._file.fileno())
            os.fchmod(self._file.fileno(), 0o444)
        except OSError as error:
            self._failure = error
            self._raise_failure()
        finally:
            self._close_file()

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
