"""The cyclic process: ``python -m drivers.cyclic RING``, with a pickled Job on its standard input.

It owns the bus for one stream and stops the arm by itself when its parent dies. One JSON line on its
standard output says how the stream ended.
"""

from __future__ import annotations

import gc
import json
import os
import pickle
import signal
import sys
import time
from dataclasses import asdict, replace
from types import FrameType

from drivers.bus.access import open_bus
from drivers.bus.lockout import Lockout
from drivers.cyclic import realtime
from drivers.cyclic.foreign import receive_cob_ids
from drivers.cyclic.loop import Loop
from drivers.errors import BusError
from drivers.frames.job import Job
from drivers.frames.ring import Ring
from drivers.frames.samples import ENDED_BY_ITSELF, StreamResult


class _Termination:
    """Whether this process was told to end. Ctrl-C is the parent's affair: it asks through the ring."""

    def __init__(self) -> None:
        self.requested = False
        signal.signal(signal.SIGTERM, self._note)
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.requested = True

    def __call__(self) -> bool:
        return self.requested


def run(job: Job, ring: Ring) -> StreamResult:
    """Open the bus and do the job in this process.

    Raises:
        BusError: the bus cannot be opened.
    """
    terminated = _Termination()
    cob_ids = receive_cob_ids(job.links, job.master_node)
    with open_bus(job.channel, cob_ids, job.bitrate) as bus:
        refused = realtime.prepare()
        # One stream makes few cyclic references; a bench that runs for days would keep them.
        gc.disable()
        loop = Loop(job, bus, ring, lambda: os.getppid() == job.parent, terminated)
        began = time.monotonic(), time.process_time()
        result = loop.run()
        if result.outcome in ENDED_BY_ITSELF:
            # The parent notes it as well, where it still lives.
            Lockout(job.channel).keep(result.reason)
        share = (time.process_time() - began[1]) / max(time.monotonic() - began[0], 1e-9)
        return replace(result, notes=(*refused, *result.notes), cpu_share=share)


def main(arguments: list[str]) -> None:
    """Read the job, run it, say how it ended."""
    job = pickle.load(sys.stdin.buffer)  # noqa: S301 (from our own parent, through a pipe)
    if not isinstance(job, Job):
        raise TypeError(f"expected a Job on standard input, got {type(job).__name__}")
    ring = Ring(int(arguments[0]), len(job.links), job.ring_capacity)
    answer: dict[str, object]
    try:
        answer = {"result": asdict(run(job, ring))}
    except BusError as error:
        answer = {"bus_error": str(error)}
    sys.stdout.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
