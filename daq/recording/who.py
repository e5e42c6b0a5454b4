"""Who runs something, and in which process."""

from __future__ import annotations

import getpass
import os
import socket
from datetime import UTC, datetime
from pathlib import Path


def now() -> datetime:
    """The time, UTC."""
    return datetime.now(tz=UTC)


def user() -> str:
    """Name of the user; the number where the system has no name for it."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def this_process() -> str:
    """This process among all that ever ran: host, process id and when it was started."""
    pid = os.getpid()
    return f"{socket.gethostname()}:{pid}:{_started(pid)}"


def is_gone(process: str) -> bool:
    """Is the process of :func:`this_process` known to have ended? Never where it ran on another host."""
    host, _, rest = process.partition(":")
    pid, _, started = rest.partition(":")
    if host != socket.gethostname() or not pid.isdecimal():
        return False
    try:
        os.kill(int(pid), 0)
    except ProcessLookupError:
        return True
    except PermissionError:
        pass  # it is another user's, and there
    return _started(int(pid)) != started


def _started(pid: int) -> str:
    """Clock ticks from boot to the start of a process; 0 where the system does not tell."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return "0"
    return stat.rpartition(")")[2].split()[19]  # proc(5), field 22, counted from after the name
