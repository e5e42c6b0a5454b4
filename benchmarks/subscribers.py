"""Many who look on at a live run, in one small process: ``python benchmarks/subscribers.py PORT RUN COUNT``.

Prints one JSON object: samples that each saw, bytes of all, processor seconds of this process.
"""

from __future__ import annotations

import asyncio
import json
import resource
import sys


async def look(port: int, run: int) -> tuple[int, int]:
    """One client: samples and bytes that it saw until the run was over."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(f"GET /api/runs/{run}/live HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
    samples = size = 0
    while piece := await reader.read(65536):
        size += len(piece)
        samples += piece.count(b'"kind":"samples"')
        if b"event: over" in piece:
            break
    writer.close()
    return samples, size


async def everyone(port: int, run: int, count: int) -> list[tuple[int, int]]:
    """All of them at once."""
    return list(await asyncio.gather(*(look(port, run) for _ in range(count))))


if __name__ == "__main__":
    found = asyncio.run(everyone(*map(int, sys.argv[1:4])))
    usage = resource.getrusage(resource.RUSAGE_SELF)
    seconds = usage.ru_utime + usage.ru_stime
    print(
        json.dumps({"samples": [n for n, _ in found], "bytes": sum(s for _, s in found), "seconds": seconds})
    )
