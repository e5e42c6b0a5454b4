"""Forged and doubled TPDOs at random instants: is one of them a sample, and does a run end as if nothing was?

    PYTHONPATH=. python benchmarks/forged_frames.py [--frames 20000] [--stalled 20] [--runs 40] [--seed 0]
        [--channel udp_multicast:239.74.9.9:23456]
    vcan-run -v -t 900 -- env PYTHONPATH=. python benchmarks/forged_frames.py --channel socketcan:vcan0

A process of its own speaks in the name of six simulated drives while an arm is driven: TPDOs with a control
signal that no drive has, exact copies of what a drive has just said, and short ones.

- *dense*: 1000 a second; here the master forgives all of them and goes on, so that each meets a stream.
  Counted are rows that are complete and hold a forged value.
- *stalled*: the same with the master or the drives stopped (SIGSTOP) for up to 0.6 s in each stream, as a
  busy machine does: drives fall silent, give up, or answer in bursts, and the forger goes on.
- *ordinary*: a few in each run, through the ordinary session and its cyclic process. A run has to end with
  "two nodes with id", or to tell of what it heard.

Ends with 2 where one of these does not hold.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

import can
import numpy as np

import robots
from drivers import ArmSession, Channel, Samples, StreamResult, open_bus
from drivers.cyclic import power
from drivers.cyclic.foreign import receive_cob_ids
from drivers.cyclic.loop import Loop
from drivers.cyclic.stream import OnSamples, _samples
from drivers.frames.job import Job
from drivers.frames.layout import RPDO, tpdo_cob_id, tpdo_layouts
from drivers.frames.requests import StreamControl
from drivers.frames.ring import Ring
from drivers.simulated import SimulatedArm
from robots.arrays import FloatArray

NAME = "tx40"
FORGED = 777
"""Raw control signal; the motion here stays below."""
RATE = 1000.0
SECONDS = 20.0
STALLED_SECONDS = 4.0
LONGEST_STALL = 0.6
QUIET = 1.0
"""s without a TPDO after which the stream is over."""
_LAYOUT = tpdo_layouts(16)[0]
_ROWS = 1 << 16
_ENABLED = 0x27


@dataclass
class Found:
    """What came of the streams so far."""

    frames: int = 0
    streams: int = 0
    rows: int = 0
    incomplete: int = 0
    forged_rows: int = 0
    """With a forged value, complete or not."""
    forged_samples: int = 0
    """Complete, with a forged value."""
    silent: int = 0
    """Streams that were forged into and ended as if nothing had been."""
    ended: int = 0
    """Streams that ended with "two nodes with id"."""

    def words(self) -> str:
        """For people."""
        return (
            f"{self.frames} frames in {self.streams} streams, {self.rows} rows, {self.incomplete} incomplete,"
            f" {self.forged_rows} with a forged value, {self.forged_samples} of them complete;"
            f" {self.ended} streams ended by it, {self.silent} as if nothing had been"
        )


def main() -> int:
    """Measure and print."""
    logging.disable(logging.WARNING)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--frames", type=int, default=20_000, help="of the dense streams")
    parser.add_argument("--stalled", type=int, default=20, help="streams with a stall")
    parser.add_argument("--runs", type=int, default=40, help="ordinary ones")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--channel", default=f"udp_multicast:239.74.9.9:{20000 + os.getpid() % 12000}")
    parser.add_argument("--forge", nargs=4, type=float, help=argparse.SUPPRESS)
    given = parser.parse_args()
    channel = Channel.parse(given.channel)
    if given.forge is not None:
        seed, count, seconds, early = given.forge
        print(json.dumps(forge(channel, int(seed), int(count), seconds, bool(early))))
        return 0
    robot = robots.load(NAME)
    dense, stalled, ordinary = Found(), Found(), Found()
    rng = np.random.default_rng(given.seed)
    with SimulatedArm(NAME, channel, seed=given.seed) as drives, ArmSession(robot, channel) as session:
        seed = given.seed
        with patch.object(power, "DOUBLES_FORGIVEN", 1 << 30), _here():
            while dense.frames < given.frames:
                seed += 1
                stream(session, dense, seed, round(RATE * SECONDS), SECONDS, early=False)
            print(f"dense: {dense.words()}", flush=True)
            for number in range(given.stalled):
                seed += 1
                with stall((os.getpid(), drives.pid)[number % 2], rng):
                    stream(
                        session, stalled, seed, round(RATE * STALLED_SECONDS), STALLED_SECONDS, early=False
                    )
            print(f"stalled: {stalled.words()}", flush=True)
        for count in rng.integers(1, 30, given.runs):
            seed += 1
            stream(session, ordinary, seed, int(count), 3.0, early=bool(seed % 2))
        print(f"ordinary: {ordinary.words()}")
    return 2 if any(found.forged_samples or found.silent for found in (dense, stalled, ordinary)) else 0


def stream(session: ArmSession, found: Found, seed: int, count: int, seconds: float, *, early: bool) -> None:
    """One stream with a forger beside it; ``early``: from the first SYNCs on, not only under torque."""
    if session.unacknowledged is not None:
        session.acknowledge_faults()
    batches = [Samples.empty(session.robot.n)]
    with forger(session.channel, seed, count, seconds - 1.0, early) as answers:
        result = session.stream(motion(session, seconds), batches.append)
    samples = Samples.concatenate(batches)
    per_count = session.robot.control_signal_per_count
    forged = np.abs(samples.control_signal - FORGED * per_count) < 0.01 * np.abs(per_count)
    sent = sum(json.loads(line)["sent"] for line in answers)
    found.frames += sent
    found.streams += 1
    found.rows += len(samples)
    found.incomplete += int((~samples.complete).any(axis=1).sum())
    found.forged_rows += int(forged.any(axis=1).sum())
    found.forged_samples += int((forged & samples.complete).any(axis=1).sum())
    found.silent += bool(sent) and _as_if_nothing(result)
    found.ended += "two nodes with id" in result.reason
    if result.outcome != "completed" and "two nodes with id" not in result.reason:
        print(f"seed {seed}: {result.outcome}: {result.reason}")


def _as_if_nothing(result: StreamResult) -> bool:
    return result.outcome == "completed" and not result.doubtful


def motion(session: ArmSession, seconds: float) -> FloatArray:
    """A little out and back, from where the arm stands."""
    t = np.linspace(0.0, 1.0, round(seconds / session.robot.bus.cycle_time))
    bell = 64 * (t * (1 - t)) ** 3
    return np.asarray(session.actual_position() + 0.05 * bell[:, None])


@contextmanager
def stall(process: int, rng: np.random.Generator) -> Iterator[None]:
    """Another process stops one once in the length of a stream, and lets it go on."""
    after, length = rng.uniform(1.5, 1.0 + STALLED_SECONDS), rng.uniform(0.05, LONGEST_STALL)
    words = f"sleep {after:.3f}; kill -STOP {process}; sleep {length:.3f}; kill -CONT {process}"
    stopper = subprocess.Popen(["sh", "-c", words])
    try:
        yield
    finally:
        stopper.wait()


@contextmanager
def forger(channel: Channel, seed: int, count: int, seconds: float, early: bool) -> Iterator[list[str]]:
    """A process that forges frames; what it says in the end is in the list after the block."""
    told = map(str, (seed, count, seconds, int(early)))
    words = [sys.executable, __file__, "--channel", str(channel), "--forge", *told]
    process = subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)},
    )
    answers: list[str] = []
    try:
        assert process.stdout is not None
        process.stdout.readline()
        yield answers
        answers += process.stdout.read().splitlines()
    finally:
        process.kill()
        process.wait()


def forge(channel: Channel, seed: int, count: int, seconds: float, early: bool) -> dict[str, int]:
    """Send frames in the name of the drives at instants that are uniform over a time.

    It begins when every drive has sent a TPDO, or, where not ``early``, one with operation enabled.
    """
    robot = robots.load(NAME)
    ids = [tpdo_cob_id(drive.node_id) for drive in robot.drive]
    rng = np.random.default_rng(seed)
    moments = np.sort(rng.uniform(0.0, seconds, count))
    latest: dict[int, bytes] = {}
    sent = 0
    with open_bus(channel, ids) as bus:
        print("ready", flush=True)
        begun = _first_answers(bus, latest, len(ids), early)
        heard = time.monotonic()
        for moment in moments:
            while (left := begun + moment - time.monotonic()) > 0:
                message = bus.recv(timeout=left)
                if message is not None:
                    latest[message.arbitration_id], heard = bytes(message.data), time.monotonic()
            if time.monotonic() - heard > QUIET:
                break
            cob_id = ids[int(rng.integers(len(ids)))]
            data = forged_data(latest[cob_id], rng)
            bus.send(can.Message(arbitration_id=cob_id, data=data, is_extended_id=False))
            sent += 1
    return {"sent": sent}


def _first_answers(bus: can.BusABC, latest: dict[int, bytes], drives: int, early: bool) -> float:
    """When every drive has sent a TPDO, s on the monotonic clock."""
    while len(latest) < drives:
        message = bus.recv(timeout=60.0)
        if message is None:
            return time.monotonic()
        if early or message.data[0] & 0x6F == _ENABLED:
            latest[message.arbitration_id] = bytes(message.data)
    return time.monotonic()


def forged_data(true: bytes, rng: np.random.Generator) -> bytes:
    """A forged frame, in one of ten cases a copy, in one of twenty a short one."""
    kind = rng.random()
    if kind < 0.1:
        return true
    statusword, position, _ = _LAYOUT.unpack(true)
    forged = _LAYOUT.pack(statusword, position + int(rng.integers(-3, 4)), FORGED)
    return forged[: RPDO.size] if kind < 0.15 else forged


@contextmanager
def _here() -> Iterator[None]:
    """Streams by the loop in this process, where the patches of this one hold."""

    def run(job: Job, on_samples: OnSamples, control: StreamControl) -> StreamResult:
        job = replace(job, ring_capacity=_ROWS)
        ring = Ring.create(len(job.links), _ROWS)
        with open_bus(job.channel, receive_cob_ids(job.links, job.master_node), job.bitrate) as bus:
            result = Loop(job, bus, ring).run()
        on_samples(_samples(ring.read(), job))
        ring.close()
        return result

    with patch("drivers.session.arm_session.run_stream", run):
        yield


if __name__ == "__main__":
    sys.exit(main())
