"""Processes that work for another one, and end with it, however that one ends."""

from __future__ import annotations

import os
import threading
import time
from typing import Any

LOOK = 0.5
"""s between two looks at the parent."""


def of_this_process() -> dict[str, Any]:
    """What joblib's loky is given so that its processes end when this one does.

    loky's own wait for work until nobody has asked for five minutes: SIGKILL and SIGTERM leave them behind.
    """
    return {"initializer": end_with, "initargs": (os.getpid(),)}


def end_with(parent: int) -> None:
    """End this process within ``LOOK`` of the parent's end, whatever it is doing then.

    Args:
        parent: id of the process that started this one.
    """
    threading.Thread(target=_watch, args=(parent,), name="parent-watch", daemon=True).start()


def _watch(parent: int) -> None:
    # Not PR_SET_PDEATHSIG: that one tells the end of the thread that started the process.
    while os.getppid() == parent:
        time.sleep(LOOK)
    os._exit(1)
