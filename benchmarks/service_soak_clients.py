"""Everybody who bothers a service at once: ``python service_soak_clients.py PORT RUN SECONDS REQUESTS SEED``.

Live clients, more than have room; mixed requests, half of them wrong; idle, slow and deaf connections. Prints
one JSON object when the live run is over and all requests were sent.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import re
import resource
import socket
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

LIVE, IDLE, SLOW, DEAF, WORKERS = 300, 40, 40, 10, 8
HOST = "127.0.0.1"
GOOD = (
    "/",
    "/runs",
    "/runs/1",
    "/arms/emps-sim",
    "/metrics",
    "/docs",
    "/openapi.json",
    "/api/arms",
    "/api/arms/emps-sim",
    "/api/runs",
    "/api/runs?limit=3",
    "/api/runs/12",
    "/monitoring/alerts.yml",
    "/static/service.css",
)
ODD = (
    "/nothing",
    "/runs/999999999999999999999",
    "/runs/-1",
    "/api/runs/x",
    "/api/runs?limit=1e9",
    "/arms/..%2f..%2fetc",
    "/api/runs/1%00/report",
    "/static/%2e%2e/%2e%2e/pyproject.toml",
    "/arms/" + "a" * 3000,
    "/api/arms/%ff%fe",
    "/api/runs/1/live",
)


@dataclass
class Seen:
    """What became of everybody.

    Attributes:
        codes: answers by kind of request and status; ``cut`` where the connection was closed without one,
            ``late`` where nothing came for a minute.
        seconds: from request to whole answer, of those with one.
        samples: lines of samples that each live client saw who was served to the end.
        refused: answers 503 to live clients.
        lived: s from connection to cut, of idle, slow and deaf connections.
        mixed_over: s from the beginning until the last mixed request was answered.
    """

    codes: Counter[str] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    samples: list[int] = field(default_factory=list)
    refused: int = 0
    lived: dict[str, list[float]] = field(default_factory=dict)
    mixed_over: float = 0.0


def good(rng: random.Random) -> bytes:
    """Something that is there."""
    return _request("GET", rng.choice(GOOD))


def odd(rng: random.Random) -> bytes:
    """Something that is not, or another method."""
    method = rng.choice(("GET", "GET", "HEAD", "OPTIONS", "PUT", "DELETE", "PATCH", "BREW"))
    return _request(method, rng.choice((*ODD, *GOOD)))


def refused(rng: random.Random) -> bytes:
    """What is turned away: names, tokens, bodies, guesses."""
    body = b"token=wrong&after=//evil.example"
    kind = rng.randrange(6)
    if kind == 0:
        return _request("GET", "/", host=rng.choice(("testserver", "evil.example", "")))
    if kind == 1:
        return _request("POST", "/api/fleet/1/check", headers=("Authorization: Bearer nobody",))
    if kind == 2:
        return _request("POST", "/login", headers=(f"Content-Length: {len(body)}",), body=body)
    if kind == 3:
        both = (f"Content-Length: {len(body)}", "Transfer-Encoding: chunked")
        return _request("POST", "/login", headers=both, body=b"0\r\n\r\n")
    if kind == 4:
        return _request("POST", "/login", headers=("Content-Length: 1073741824",))
    return _request("GET", "/", headers=("X: " + "y" * 40_000,))


def garbage(rng: random.Random) -> bytes:
    """No HTTP at all."""
    return rng.randbytes(rng.randrange(1, 400)) + b"\r\n\r\n"


KINDS: tuple[tuple[str, int, Callable[[random.Random], bytes]], ...] = (
    ("good", 10, good),
    ("odd", 5, odd),
    ("refused", 4, refused),
    ("garbage", 1, garbage),
)
"""Name, weight, and what makes one."""


def _request(
    method: str, path: str, *, host: str = "localhost", headers: tuple[str, ...] = (), body: bytes = b""
) -> bytes:
    lines = (f"{method} {path} HTTP/1.1", f"Host: {host}", *headers, "Connection: close", "", "")
    return "\r\n".join(lines).encode() + body


async def ask(port: int, request: bytes) -> str:
    """The status of the answer when it was read; ``cut`` where there was none, ``late`` after a minute."""
    reader, writer = await asyncio.open_connection(HOST, port)
    try:
        writer.write(request)
        answer = b""
        while piece := await asyncio.wait_for(reader.read(65536), 60):
            answer = answer or piece[:20]
        status = re.match(rb"HTTP/1\.1 (\d{3})", answer)
        return status[1].decode() if status else "cut"
    except ConnectionError:
        return "cut"
    except TimeoutError:
        return "late"
    finally:
        writer.close()


async def mixed(port: int, seen: Seen, count: int, interval: float, rng: random.Random) -> None:
    """So many requests one after the other, at least an interval apart on the mean, s."""
    begun = time.monotonic()
    for number in range(count):
        await asyncio.sleep(max(0.0, begun + number * interval - time.monotonic()))
        name, _, make = rng.choices(KINDS, [weight for _, weight, _ in KINDS])[0]
        sent = time.monotonic()
        status = await ask(port, make(rng))
        seen.codes[f"{name} {status}"] += 1
        if status not in ("cut", "late"):
            seen.seconds.append(time.monotonic() - sent)


async def look(port: int, run: int, seen: Seen) -> None:
    """A live client: comes again after as long as it is told to while there is no room."""
    while True:
        reader, writer = await asyncio.open_connection(HOST, port)
        writer.write(f"GET /api/runs/{run}/live HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        head = await reader.readuntil(b"\r\n\r\n")
        if b" 503 " not in head.split(b"\r\n")[0]:
            break
        seen.refused += 1
        writer.close()
        wait = re.search(rb"(?i)retry-after: (\d+)", head)
        assert wait is not None
        await asyncio.sleep(int(wait[1]))
    if b" 200 " not in head.split(b"\r\n")[0]:
        seen.codes[f"live {head[9:12].decode()}"] += 1
        return
    samples = 0
    while piece := await reader.read(65536):
        samples += piece.count(b'"kind":"samples"')
        if b"event: over" in piece:
            seen.samples.append(samples)
            break
    writer.close()


async def _until_cut(port: int, seen: Seen, name: str, bother: Callable[[Any, Any], Awaitable[None]]) -> None:
    while True:
        client = socket.socket()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.setblocking(False)
        await asyncio.get_running_loop().sock_connect(client, (HOST, port))
        reader, writer = await asyncio.open_connection(sock=client, limit=2048)
        begun = time.monotonic()
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError):
            await bother(reader, writer)
        seen.lived.setdefault(name, []).append(time.monotonic() - begun)
        writer.close()


async def idle(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Never asks."""
    await reader.read()


async def slow(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """A byte a second."""
    writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
    while True:
        writer.write(b"a")
        await writer.drain()
        with contextlib.suppress(TimeoutError):
            if not await asyncio.wait_for(reader.read(1), 1.0):
                return


async def deaf(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Asks for pages and never reads them."""
    writer.transport.pause_reading()  # type: ignore[attr-defined]
    while not writer.transport.is_closing():
        writer.write(b"GET /arms/emps-sim HTTP/1.1\r\nHost: localhost\r\n\r\n" * 20)
        await writer.drain()
        await asyncio.sleep(1.0)


async def everybody(port: int, run: int, seconds: float, requests: int, seed: int) -> Seen:
    """All of them at once until the run is over and all requests were sent."""
    seen = Seen()
    share = requests // WORKERS
    busy = [
        mixed(port, seen, share, seconds * 0.9 / share, random.Random(1000 * seed + k))
        for k in range(WORKERS)
    ]
    watching = [look(port, run, seen) for _ in range(LIVE)]
    bothering = [
        asyncio.create_task(_until_cut(port, seen, name, how))
        for name, count, how in (("idle", IDLE, idle), ("slow", SLOW, slow), ("deaf", DEAF, deaf))
        for _ in range(count)
    ]
    lookers = [asyncio.create_task(one) for one in watching]
    begun = time.monotonic()
    await asyncio.gather(*busy)
    seen.mixed_over = time.monotonic() - begun
    # Those who had no room come again until the run is over; then they are told that there is none.
    await asyncio.wait(lookers, timeout=seconds + 60)
    for task in (*bothering, *lookers):
        task.cancel()
    await asyncio.gather(*bothering, *lookers, return_exceptions=True)
    return seen


def main() -> None:
    """Bother, and print what became of it."""
    port, run, seconds, requests, seed = (float(word) for word in sys.argv[1:6])
    seen = asyncio.run(everybody(int(port), int(run), seconds, int(requests), int(seed)))
    used = resource.getrusage(resource.RUSAGE_SELF)
    ordered = sorted(seen.seconds)
    print(
        json.dumps(
            {
                "codes": dict(sorted(seen.codes.items())),
                "requests": sum(seen.codes.values()),
                "mixed_over": seen.mixed_over,
                "seconds": {q: ordered[min(int(q * len(ordered)), len(ordered) - 1)] for q in (0.5, 0.99, 1)},
                "served": len(seen.samples),
                "samples": [min(seen.samples, default=0), max(seen.samples, default=0)],
                "refused": seen.refused,
                "lived": {
                    name: {"cut": len(times), "longest": max(times)} for name, times in seen.lived.items()
                },
                "processor": used.ru_utime + used.ru_stime,
            }
        )
    )


if __name__ == "__main__":
    main()
