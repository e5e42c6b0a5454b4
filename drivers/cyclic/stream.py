"""The parent's side of a stream: start the cyclic process, fetch its samples, pass on a stop."""

from __future__ import annotations

import json
import logging
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import IO, Any

from numpy.typing import NDArray

from drivers.errors import BusError
from drivers.frames.job import Job
from drivers.frames.requests import StreamControl
from drivers.frames.ring import Request, Ring
from drivers.frames.samples import Samples, StreamResult

log = logging.getLogger(__name__)

FETCH_SECONDS = 0.05
"""Between two batches."""

REQUESTED = {
    "abort requested": "",
    "halt requested": "",
    "stop requested: the period was finished": ", at the end of the period",
    "stop requested in a pause": ", in a pause",
}
"""What the cyclic process says of a request, and what that adds to the reason of who asked."""


class BusNotOpened(BusError):
    """The cyclic process could not open the bus: no drive was told anything."""


OnSamples = Callable[[Samples], None]


def run_stream(job: Job, on_samples: OnSamples, control: StreamControl) -> StreamResult:
    """Stream in a process of its own and hand the samples over as they come.

    While it runs, Ctrl-C and SIGTERM (where this is the main thread) ask for a controlled ramp, as an abort
    does; this returns when the drives are disabled. An exception in ``on_samples`` stops the arm and is
    raised then.

    Raises:
        BusNotOpened: the cyclic process could not open the bus.
    """
    ring = Ring.create(len(job.links), job.ring_capacity)
    with tempfile.TemporaryFile() as errors, _signals_abort(control):
        process = _start(job, ring, errors)
        control.attach(ring)
        try:
            _attend(process, job, ring, on_samples, control)
            answer = process.stdout.read() if process.stdout else b""
        finally:
            # Also where on_samples has raised: nobody leaves while the arm moves.
            ring.request(Request.ABORT)
            process.wait()
            control.detach()
            ring.close()
            if process.stdout is not None:
                process.stdout.close()
        result = _result(answer, process.returncode, errors, job)
    for note in result.notes:
        log.info("cyclic process: %s", note)
    for words in result.doubtful:
        log.warning("%s", words)
    if (asked := control.reason) and result.reason in REQUESTED:
        return replace(result, reason=asked + REQUESTED[result.reason])
    return result


def _start(job: Job, ring: Ring, errors: IO[bytes]) -> subprocess.Popen[bytes]:
    root = str(Path(__file__).resolve().parents[2])
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "drivers.cyclic", str(ring.descriptor)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        pass_fds=[ring.descriptor],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        # Its own session: a Ctrl-C at the terminal reaches only the parent, which asks for a ramp.
        start_new_session=True,
    )
    if process.stdin is not None:
        try:
            process.stdin.write(pickle.dumps(job))
            process.stdin.close()
        except BrokenPipeError:
            log.debug("the cyclic process ended before it took its job")
    return process


def _attend(
    process: subprocess.Popen[bytes], job: Job, ring: Ring, on_samples: OnSamples, control: StreamControl
) -> None:
    """Fetch samples until the process has ended and the ring is empty."""
    running = True
    while running:
        running = process.poll() is None
        control.poll()
        rows = ring.read()
        if len(rows):
            on_samples(_samples(rows, job))
        if running:
            time.sleep(FETCH_SECONDS)


@contextmanager
def _signals_abort(control: StreamControl) -> Iterator[None]:
    """Let SIGINT and SIGTERM ask for a controlled ramp."""

    def note(number: int, frame: FrameType | None) -> None:
        control.abort("Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _result(answer: bytes, code: int, errors: IO[bytes], job: Job) -> StreamResult:
    if answer.strip():
        message = json.loads(answer)
        if "bus_error" in message:
            raise BusNotOpened(message["bus_error"])
        fields = message["result"]
        lists = ("notes", "doubtful", "pauses", "torque_unconfirmed", "rest_unconfirmed", "restarted")
        return StreamResult(**fields | {name: tuple(fields[name]) for name in lists})
    errors.seek(0)
    log.error("the cyclic process failed: %s", errors.read().decode(errors="replace").strip())
    reason = f"the cyclic process ended without a result (exit code {code})"
    # The drives have missed their master by now and stopped by themselves; nobody has seen it.
    return StreamResult(
        outcome="aborted",
        reason=reason,
        cycles=None,
        missed_cycles=None,
        late_cycles=None,
        incomplete_cycles=None,
        incomplete_before=None,
        overflows=None,
        torque_unconfirmed=job.drives,
        rest_unconfirmed=job.drives,
    )


def _samples(rows: NDArray[Any], job: Job) -> Samples:
    """Decode counts and raw values into SI units."""
    return Samples(
        cycle=rows["cycle"].copy(),
        time=rows["cycle"] * job.cycle_time,
        reference=job.units.position(rows["target"]),
        position=job.units.position(rows["position"]),
        control_signal=job.units.control_signal(rows["control_signal"]),
        statusword=rows["statusword"].copy(),
        complete=rows["complete"].copy(),
        lateness=rows["lateness"].copy(),
        velocity=job.units.velocity(rows["velocity"]),
    )
