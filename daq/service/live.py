"""Server-sent events of a run under way: one reader per run, however many look on.

A look at the file every tenth of a second makes one piece of bytes with everything that is new, and all who
look on are sent that same piece: a further one costs a write to a socket and nothing else.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncGenerator, Callable, Sequence
from pathlib import Path

from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

POLL = 0.1
"""s between two looks at the file, and so between two pieces that are sent."""
PATIENCE = 15.0
"""s without anything new after which a comment keeps the connection open."""
MOST_LOOKING = 200
"""Connections in all; more are refused."""
MOST_LINES = 300
"""Lines of one look that are sent: as many as a page draws, where a reader comes late to a long run."""
OVER = b"event: over\ndata: {}\n\n"
STILL_THERE = b": still there\n\n"
_WAITING = 50
_PIECE = 262_144
_QUIET = 10
"""Looks without anything new after which somebody is asked whether the run is over."""


class TooManyError(Exception):
    """More look on than are allowed."""


class _Subscriber:
    """One who looks on: what it has not been sent yet."""

    def __init__(self) -> None:
        self.pieces: deque[bytes] = deque(maxlen=_WAITING)  # who is slow misses some, nobody waits for them
        self.news = asyncio.Event()


class _Run:
    """One run that somebody looks on."""

    def __init__(self) -> None:
        self.subscribers: set[_Subscriber] = set()
        self.begin: bytes | None = None
        self.recent: deque[bytes] = deque(maxlen=MOST_LINES)
        self.is_over = False
        self.reader: asyncio.Task[None] | None = None

    def join(self, subscriber: _Subscriber) -> None:
        """Who comes late is sent the last lines at once."""
        self.subscribers.add(subscriber)
        if self.recent:
            subscriber.pieces.append(b"".join(self.recent))
        subscriber.news.set()

    def tell(self, events: Sequence[bytes]) -> None:
        piece = b"".join(events)
        self.recent.extend(events)
        for subscriber in self.subscribers:
            if piece:
                subscriber.pieces.append(piece)
            subscriber.news.set()

    def end(self) -> None:
        self.is_over = True
        self.tell(())


class Subscription:
    """One place among those who look on: its pieces, and how it is given back, whether or not one was sent.

    Args:
        pieces: what it is sent.
        leave: gives the place back; may be called twice.
    """

    def __init__(self, pieces: AsyncGenerator[bytes], leave: Callable[[], None]) -> None:
        self._pieces = pieces
        self.leave = leave

    async def __aiter__(self) -> AsyncGenerator[bytes]:
        try:
            async for piece in self._pieces:
                yield piece
        finally:
            self.leave()


class EventStream(StreamingResponse):
    """Server-sent events. A client that is gone before the first one gives its place back too.

    Args:
        subscription: what is sent.
    """

    def __init__(self, subscription: Subscription) -> None:
        headers = {"X-Accel-Buffering": "no"}
        super().__init__(aiter(subscription), media_type="text/event-stream", headers=headers)
        self._subscription = subscription

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._subscription.leave()


class Broadcaster:
    """Hands what is new in live files to everybody who looks on."""

    def __init__(self) -> None:
        self._runs: dict[Path, _Run] = {}

    @property
    def looking(self) -> int:
        """Open connections."""
        return sum(len(run.subscribers) for run in self._runs.values())

    @property
    def reading(self) -> int:
        """Files that are read."""
        return len(self._runs)

    def require_room(self) -> None:
        """Raises :class:`TooManyError` where nobody else may look on."""
        if self.looking >= MOST_LOOKING:
            raise TooManyError(f"more than {MOST_LOOKING} look on already")

    def events(self, path: Path, is_over: Callable[[], bool]) -> Subscription:
        """Server-sent events of a file until its run ends; the line of its beginning comes first to each.

        Args:
            path: of the lines; may not be there yet.
            is_over: whether the run has ended, for files that never say so.

        Raises:
            TooManyError: at once: the place is taken here, before anything is sent.
        """
        self.require_room()
        run = self._runs.setdefault(path, _Run())
        subscriber = _Subscriber()
        run.join(subscriber)
        if run.reader is None:
            run.reader = asyncio.create_task(self._read(run, path, is_over))

        def leave() -> None:
            run.subscribers.discard(subscriber)
            if not run.subscribers and self._runs.get(path) is run:
                del self._runs[path]
                if run.reader is not None:
                    run.reader.cancel()

        return Subscription(_sent(run, subscriber), leave)

    async def _read(self, run: _Run, path: Path, is_over: Callable[[], bool]) -> None:
        try:
            await self._read_on(run, path, is_over)
        finally:
            run.end()

    async def _read_on(self, run: _Run, path: Path, is_over: Callable[[], bool]) -> None:
        """Read the file as it grows, until its run is over."""
        place, rest, quiet = 0, b"", 0
        while True:
            piece = await asyncio.to_thread(_piece, path, place)
            if piece is None:
                place, rest, piece = 0, b"", b""
            place += len(piece)
            *lines, rest = (rest + piece).split(b"\n")
            for line in lines:
                if b'"kind":"begin"' in line:
                    run.begin = _event(line)
            events = [_event(line) for line in lines if b'"kind":"begin"' not in line]
            if lines:
                run.tell(events[-MOST_LINES:])
            if any(b'"kind":"end"' in line for line in lines):
                return
            quiet = 0 if piece else quiet + 1
            if quiet == _QUIET:
                quiet = 0
                if await asyncio.to_thread(is_over):
                    return
            if len(piece) < _PIECE:
                await asyncio.sleep(POLL)


async def _sent(run: _Run, subscriber: _Subscriber) -> AsyncGenerator[bytes]:
    """What one who looks on is sent."""
    greeted: bytes | None = None
    while True:
        try:
            await asyncio.wait_for(subscriber.news.wait(), PATIENCE)
        except TimeoutError:
            yield STILL_THERE
            continue
        subscriber.news.clear()
        if run.begin is not None and run.begin is not greeted:
            greeted = run.begin
            yield run.begin
        while subscriber.pieces:
            yield subscriber.pieces.popleft()
        if run.is_over:
            yield OVER
            return


def _event(line: bytes) -> bytes:
    return b"data: " + line + b"\n\n"


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
