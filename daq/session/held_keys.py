"""A key of a terminal that is held down.

A terminal tells that a key repeats, and never that it was let go. So a key is held while its repeats come as
they came so far: it has to repeat before it counts, and it is let go where three repeats in a row stay away,
or any other key comes.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import select
import statistics
import termios
import threading
import time
import tty
from collections import deque
from collections.abc import Callable
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Self

from daq.session.questions import QUIET

MISSED_REPEATS = 3
"""Repeats that stay away in a row until a key has been let go: one may be late, two may come as one."""

_LOOK = 0.05
"""How often the reader looks whether it is to end, s."""
_KEY = re.compile(r"\x1b[\[O]([ABCD])|(.)", re.DOTALL)
_UNFINISHED = re.compile(r"\x1b[\[O]?$")
_ARROWS = {"A": "up", "B": "down", "C": "right", "D": "left"}


class HeldKeys:
    """Which key is held, and which were pressed; reads a terminal in a thread of its own inside the block.

    What was typed before the block counts for nothing. Ctrl-C keeps its meaning.

    Args:
        source: descriptor of the terminal.
        clock: monotonic time, s.
    """

    def __init__(self, source: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._source = source
        self._clock = clock
        self._lock = threading.Lock()
        self._key = ""
        self._times: deque[float] = deque(maxlen=8)
        self._pressed: SimpleQueue[str] = SimpleQueue()
        self._ended = threading.Event()
        self.gone = False
        """Whether the terminal is."""

    def __enter__(self) -> Self:
        self._before = termios.tcgetattr(self._source)
        tty.setcbreak(self._source, termios.TCSAFLUSH)
        self._reader = threading.Thread(target=self._read, name="keys", daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._reader.join()
        with contextlib.suppress(termios.error):  # the terminal is gone
            termios.tcsetattr(self._source, termios.TCSAFLUSH, self._before)

    def held(self) -> str:
        """The key that is held at this moment; empty where none is."""
        with self._lock:
            times = list(self._times)
            if len(times) < 2:
                return ""
            usual = statistics.median(after - before for before, after in itertools.pairwise(times))
            since = self._clock() - times[-1]
            return self._key if since <= min(QUIET, MISSED_REPEATS * usual) else ""

    def pressed(self, seconds: float) -> str:
        """The next key that was pressed, its repeats among them; empty where none is within a time."""
        try:
            return self._pressed.get(timeout=seconds)
        except Empty:
            return ""

    def forget(self) -> None:
        """Whatever was pressed so far counts for nothing more."""
        while self.pressed(0.0):
            pass

    def heard(self, keys: list[str]) -> None:
        """Keys have come in one piece: a piece is one moment, however many repeats it holds."""
        now = self._clock()
        with self._lock:
            same = bool(self._times) and set(keys) == {self._key} and now - self._times[-1] <= QUIET
            if not same:
                self._times.clear()
            self._key = keys[-1]
            self._times.append(now)
        for key in dict.fromkeys(keys):
            self._pressed.put(key)

    def _read(self) -> None:
        rest = ""
        while not self._ended.is_set():
            if not select.select([self._source], [], [], _LOOK)[0]:
                continue
            try:
                data = os.read(self._source, 256)
            except OSError:
                data = b""
            if not data:
                self.gone = True
                return
            rest += data.decode(errors="replace")
            tail = _UNFINISHED.search(rest)
            text, rest = (rest[: tail.start()], rest[tail.start() :]) if tail else (rest, "")
            keys = [_ARROWS[arrow] if arrow else key for arrow, key in _KEY.findall(text)]
            if keys:
                self.heard(keys)
