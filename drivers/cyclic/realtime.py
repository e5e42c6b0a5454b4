"""What keeps a Python process on time, as far as the system permits it; what it does not is said."""

from __future__ import annotations

import ctypes
import gc
import os
import sys

MASTER_PRIORITY = 40
"""SCHED_FIFO priority: above ordinary processes, below the kernel's own interrupt threads (50)."""
DRIVES_PRIORITY = 30
"""For simulated drives, which answer the master and must not delay it."""

_MCL_CURRENT_AND_FUTURE = 1 | 2
_PR_SET_TIMERSLACK = 29


def prepare(priority: int = MASTER_PRIORITY) -> tuple[str, ...]:
    """Freeze the heap, take real-time priority, lock memory, sharpen the timers of this process.

    Returns:
        One line for each thing that the system refused.
    """
    freeze_heap()
    refused = [line for line in (take_priority(priority), _lock_memory()) if line]
    _sharpen_timers()
    return tuple(refused)


def freeze_heap() -> None:
    """Take what exists now out of garbage collection: later collections then look at little and are short."""
    gc.collect()
    gc.freeze()


def take_priority(priority: int) -> str | None:
    """Ask for real-time scheduling of this process; a line that says why not where the system refuses."""
    if not hasattr(os, "sched_setscheduler"):
        return "no real-time priority: this system has no SCHED_FIFO"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return f"no real-time priority (SCHED_FIFO {priority}): {error.strerror}"
    return None


def _lock_memory() -> str | None:
    if sys.platform != "linux":
        return "memory not locked: no mlockall here"
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT_AND_FUTURE) != 0:
        return f"memory not locked (mlockall): {os.strerror(ctypes.get_errno())}"
    return None


def _sharpen_timers() -> None:
    """Ordinary scheduling rounds sleeps up by 50 µs; ask for 1 ns. Real-time scheduling ignores it."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
