"""Processes of this machine by what their environment says."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path


def processes_marked(mark: str) -> Iterator[tuple[str, str]]:
    """Process id and command line of each living process that has inherited the mark.

    Args:
        mark: an entry of the environment, NAME=value.
    """
    for process in Path("/proc").glob("[0-9]*"):
        try:
            environment = (process / "environ").read_bytes().split(b"\0")
            command = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:  # ended meanwhile, or another user's
            continue
        if mark.encode() in environment:
            yield process.name, command.strip()
