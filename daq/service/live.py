"""Server-sent events of a run under way: one reader per run, however many look on."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from pathlib import Path

POLL = 0.1
"""s between two looks at the file."""
PATIENCE = 15.0
"""s without a line after which a comment keeps the connection open."""
MOST_LOOKING = 200
"""Connections in all; more are refused."""
_QUEUE = 50
_PIECE = 262_144


class TooManyError(Exception):
    """More look on than are allowed."""


class Hub:
    """Hands the lines of live files to everybody who looks on."""

    def __init__(self) -> None:
        self._queues: dict[Path, set[asyncio.Queue[str | None]]] = {}
        self._readers: dict[Path, asyncio.Task[None]] = {}
        self._first: dict[Path, str] = {}

    @property
    def looking(self) -> int:
        """Open connections."""
        return sum(map(len, self._queues.values()))

    async def events(self, path: Path, is_over: Callable[[], bool]) -> AsyncIterator[str]:
        """Server-sent events of a file until its run ends.

        Args:
            path: of the lines; may not be there yet.
            is_over: whether the run has ended, for files that never say so.

        Raises:
            TooManyError: at once.
        """
        if self.looking >= MOST_LOOKING:
            raise TooManyError(f"more than {MOST_LOOKING} look on already")
        queue: asyncio.Queue[str | None] = asyncio.Queue(_QUEUE)
        self._queues.setdefault(path, set()).add(queue)
        if path in self._first:
            queue.put_nowait(self._first[path])  # who comes late is told what this is
        if path not in self._readers:
            self._readers[path] = asyncio.create_task(self._read(path, is_over))
        try:
            while True:
                try:
                    line = await asyncio.wait_for(queue.get(), PATIENCE)
                except TimeoutError:
                    yield ": still there\n\n"
                    continue
                if line is None:
                    yield "event: over\ndata: {}\n\n"
                    return
                yield f"data: {line}\n\n"
        finally:
            self._queues[path].discard(queue)
            if not self._queues[path]:
                del self._queues[path]
                self._first.pop(path, None)
                task = self._readers.pop(path, None)
                if task is not None:
                    task.cancel()

    async def _read(self, path: Path, is_over: Callable[[], bool]) -> None:
        """Read the file as it grows."""
        place, rest = 0, b""
        while True:
            piece = await asyncio.to_thread(_piece, path, place)
            if piece is None:
                place, rest, piece = 0, b"", b""
            place += len(piece)
            *lines, rest = (rest + piece).split(b"\n")
            for line in lines:
                text = line.decode("utf-8", "replace")
                if '"kind":"begin"' in text:
                    self._first[path] = text
                self._tell(path, text)
                if '"kind":"end"' in text:
                    self._tell(path, None)
                    return
            if not piece:
                if await asyncio.to_thread(is_over):
                    self._tell(path, None)
                    return
                await asyncio.sleep(POLL)

    def _tell(self, path: Path, line: str | None) -> None:
        for queue in tuple(self._queues.get(path, ())):
            if queue.full():
                queue.get_nowait()  # who is slow misses lines, nobody waits for them
            queue.put_nowait(line)


def _piece(path: Path, place: int) -> bytes | None:
    """What has come behind a place; None where the file has begun anew."""
    try:
        if path.stat().st_size < place:
            return None
        with path.open("rb") as file:
            file.seek(place)
            return file.read(_PIECE)
    except FileNotFoundError:
        return b""
