"""A witness beside a timing benchmark: when did this machine itself stand still?

One process per core, above every other in priority, that does nothing but sleep a millisecond at a time.
Where even it does not wake, no program can: the host of a virtual machine has taken the processor away, or
the kernel keeps it. A benchmark that missed deadlines then knows which of them were its own.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path

PRIORITY = 90
NAP = 0.001
SHORTEST = 0.001
"""s beyond the nap that count as a stall."""

Stall = tuple[float, float]
"""Beginning and end, s of the monotonic clock."""


def _watch(core: int, answer: Connection) -> None:
    ended = False

    def end(number: int, frame: object) -> None:
        nonlocal ended
        ended = True

    signal.signal(signal.SIGTERM, end)
    os.sched_setaffinity(0, {core})
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    stalls: list[Stall] = []
    before = time.monotonic()
    while not ended:
        time.sleep(NAP)
        now = time.monotonic()
        if now - before > NAP + SHORTEST:
            stalls.append((before, now))
        before = now
    answer.send(stalls)


@contextlib.contextmanager
def witness() -> Iterator[list[Stall]]:
    """Watch while the block runs; the list is filled when it ends, over all cores."""
    found: list[Stall] = []
    context = multiprocessing.get_context("spawn")
    watchers = []
    for core in sorted(os.sched_getaffinity(0)):
        ours, theirs = context.Pipe()
        process = context.Process(target=_watch, args=(core, theirs))
        process.start()
        watchers.append((process, ours))
    try:
        yield found
    finally:
        for process, ours in watchers:
            process.terminate()
            found += ours.recv()
            process.join()
        found.sort()


def stolen_seconds() -> float:
    """Processor time that the host of a virtual machine has given to others since the start, all cores, s."""
    fields = Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()
    return int(fields[8]) / os.sysconf("SC_CLK_TCK")


def covered(moment: float, stalls: list[Stall], margin: float) -> bool:
    """Whether a moment lies in a stall, or so shortly after one."""
    return any(begin - margin <= moment <= end + margin for begin, end in stalls)
