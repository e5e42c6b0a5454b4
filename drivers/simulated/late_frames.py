"""Frames of drives that answer a SYNC late: kept until they are due."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from math import inf

from drivers.bus.ports import Frame


class LateFrames:
    """Frames in the order in which they are due; times are s of a monotonic clock."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[float, Frame]] = deque()

    def put(self, frames: Iterable[Frame], due: float) -> None:
        """Keep frames until then."""
        self._waiting.extend((due, frame) for frame in frames)

    def next_event(self) -> float:
        """When the next one is due."""
        return self._waiting[0][0] if self._waiting else inf

    def due(self, now: float) -> list[Frame]:
        """What is due, and kept no longer."""
        frames = []
        while self._waiting and self._waiting[0][0] <= now:
            frames.append(self._waiting.popleft()[1])
        return frames
