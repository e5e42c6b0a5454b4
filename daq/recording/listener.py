"""Hear every frame of a bus at next to no cost for the control loop: a second socket that only receives.

The cyclic process could hand its frames over as it hands over its samples, through shared memory; that would
cost it about a microsecond a frame in the loop that must not be late, and it hears only what it filters for.
A second socket sees all frames, the master's own and other nodes' too; the kernel copies them, stamps them
with the time of their arrival, and keeps them until this process has time. Where they are not fetched in
time, the kernel counts the loss. On UDP the copy is made while the sender sends: 0.3 to 0.4 µs a frame
(``benchmarks/recording_load.py`` says what the rest costs); on SocketCAN it is made where a frame arrives.
"""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import TracebackType
from typing import Protocol, Self

import can
import numpy as np
from can.interfaces.socketcan import SocketcanBus

from daq.recording.datagrams import DatagramReader
from daq.recording.frame_decoding import MulticastDecoder, decode_socketcan
from daq.recording.frames import Frames
from daq.recording.steady_clock import SteadyClock
from drivers.bus.access import open_bus
from drivers.bus.multicast import LocalMulticastBus, enlarge_receive_buffer
from drivers.bus.ports import dropped_frames
from drivers.errors import BusError
from drivers.frames.channel import Channel

log = logging.getLogger(__name__)

FETCH_SECONDS = 0.04
"""Between two looks; at 20 000 frames a second 800 wait by then."""
RECEIVE_BUFFER = 16 << 20
"""Bytes. A frame is booked with about 1 kB, so this holds more than half a second of 20 000 a second: where
the machine is busy, this process waits and not the cyclic one."""
OnFrames = Callable[[Frames], None]


class _Source(Protocol):
    def take(self) -> Frames:
        """What has come, at most a few hundred frames; none where nothing has."""

    def dropped(self) -> int:
        """Frames that the kernel found no room for."""


class FrameListener:
    """Hands every frame of a bus to its subscribers, in batches, in a thread of its own.

    Args:
        channel: which bus.
        bitrate: bit/s, for interfaces whose hardware is set from here.

    Raises:
        BusError: the bus cannot be opened a second time: not every maker's library allows that.
    """

    def __init__(self, channel: Channel, bitrate: int = 1_000_000) -> None:
        self.channel = channel
        self.failure: str | None = None
        """Why it hears nothing any more."""
        self.clock = SteadyClock()
        """Of the frames' stamps: whoever records samples beside them takes its time from it, too."""
        self._bus = open_bus(channel, bitrate=bitrate)
        self._source = _source(self._bus)
        self._subscribers: tuple[OnFrames, ...] = ()
        self._fetching = threading.Lock()
        self._ended = threading.Event()
        self._dropped = 0
        self._thread = threading.Thread(target=self._run, name="can-listener", daemon=True)
        self._thread.start()

    def subscribe(self, on_frames: OnFrames) -> None:
        """Hand batches over from now on; ``on_frames`` is called in the listener's thread."""
        self._subscribers = (*self._subscribers, on_frames)

    def unsubscribe(self, on_frames: OnFrames) -> None:
        """Hand over what has come until now, then no more."""
        self.fetch()
        with self._fetching:
            self._subscribers = tuple(s for s in self._subscribers if s != on_frames)

    @property
    def dropped(self) -> int:
        """Frames that came and were lost because nobody fetched them in time."""
        return self._dropped

    def fetch(self) -> None:
        """Take in and hand over what has come until now."""
        with self._fetching:
            if self.failure is None and not self._ended.is_set():
                self._fetch()

    def _run(self) -> None:
        while not self._ended.wait(FETCH_SECONDS):
            self.fetch()

    def _fetch(self) -> None:
        try:
            while len(frames := self._source.take()):
                frames = replace(frames, stamp=self.clock.steady(frames.stamp))
                for subscriber in self._subscribers:
                    subscriber(frames)
            self._dropped = self._source.dropped()
        except (OSError, can.CanError) as error:
            self.failure = f"{self.channel}: frames are not heard any more: {error}"
            log.warning(self.failure)

    def close(self) -> None:
        """Hand over what has come, and give the bus back."""
        self.fetch()
        self._ended.set()
        self._thread.join()
        self._bus.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


@contextmanager
def listening(channel: Channel, bitrate: int = 1_000_000) -> Iterator[FrameListener | None]:
    """A listener for as long as the context lasts; None, and a line in the log, where the bus has no room
    for a second one."""
    try:
        listener = FrameListener(channel, bitrate)
    except BusError as error:
        log.warning("raw frames are not recorded: %s", error)
        yield None
        return
    with listener:
        yield listener


def _source(bus: can.BusABC) -> _Source:
    if isinstance(bus, LocalMulticastBus):
        return _SocketSource(bus.sockets[0], MulticastDecoder().decode)
    if isinstance(bus, SocketcanBus):
        return _SocketSource(bus.socket, decode_socketcan)
    return _MessageSource(bus)


class _SocketSource:
    def __init__(self, sock: socket.socket, decode: Callable[..., Frames]) -> None:
        self._socket = sock
        enlarge_receive_buffer(sock, RECEIVE_BUFFER)
        self._reader = DatagramReader(sock)
        self._decode = decode
        self._base = dropped_frames(sock)

    def take(self) -> Frames:
        while len((datagrams := self._reader.read()).size):
            if len(frames := self._decode(datagrams)):
                return frames
        return Frames.empty()

    def dropped(self) -> int:
        return dropped_frames(self._socket) - self._base


class _MessageSource:
    """Any python-can bus, message by message."""

    MOST = 512

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def take(self) -> Frames:
        found: list[can.Message] = []
        while len(found) < self.MOST and (message := self._bus.recv(timeout=0)) is not None:
            if not message.is_fd:
                found.append(message)
        frames = Frames.empty(len(found))
        for row, message in enumerate(found):
            frames.stamp[row] = round(message.timestamp * 1e9) or time.time_ns()
            frames.can_id[row] = message.arbitration_id
            frames.is_rtr[row] = message.is_remote_frame
            frames.is_extended[row] = message.is_extended_id
            frames.is_error[row] = message.is_error_frame
            frames.dlc[row] = message.dlc
            frames.data[row, : len(message.data)] = np.frombuffer(bytes(message.data), dtype=np.uint8)
        return frames

    def dropped(self) -> int:
        return 0
