"""What the cyclic process itself does in each SYNC period: the longest ones, and where they are.

    PYTHONPATH=. python benchmarks/cycle_work.py [--seconds 60] [--before TREE [--pairs 6]]

The loop of the master streams to six simulated drives in one process and in virtual time. Counted is the
processor time of its own work from each SYNC to the next: state machine, checks, RPDOs, record, and not
what the drives do, nor any waiting. It is processor time, so a busy machine hardly changes it; what the
machine itself does to a cycle is measured by ``cyclic.py``. Beside it are the page faults of each period
(no memory is locked here) and whether any garbage was collected. With ``--before`` another source tree and
this one are measured in turn, and each pair gives a ratio.
"""

from __future__ import annotations

import argparse
import gc
import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from unittest.mock import patch

import numpy as np

import robots
from drivers.bus.ports import Frame
from drivers.cyclic import realtime
from drivers.cyclic.cycle import Cycle
from drivers.simulated import draw_truth
from drivers.simulated.in_process import InProcessBus, stream_in_process
from robots import Robot
from robots.arrays import FloatArray

LONGEST = 8
SYNC_COB_ID = 0x080  # of its own: --before measures trees in which layouts are elsewhere


class TimedPort:
    """The drives as a port; keeps apart what they take and what the master takes."""

    def __init__(self, bus: InProcessBus) -> None:
        self._bus = bus
        self._began = time.thread_time()
        self._drives = 0.0
        self._faults = 0
        self.work: list[float] = []
        """s of processor time, from each SYNC to the next."""
        self.page_faults: list[int] = []

    def beside(self, entered: float) -> None:
        """What was done since then (s of processor time) is not the master's."""
        self._drives += time.thread_time() - entered

    def send(self, cob_id: int, data: bytes) -> bool:
        entered = time.thread_time()
        if cob_id == SYNC_COB_ID:
            self.work.append(entered - self._began - self._drives)
            faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
            self.page_faults.append(faults - self._faults)
            self._bus.on_sync(self._bus.syncs)
            self._bus.syncs += 1
        self._bus.group.receive(cob_id, data, self._bus.now)
        left = time.thread_time()
        if cob_id == SYNC_COB_ID:
            self._faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
            self._began, self._drives = left, 0.0
        else:
            self._drives += left - entered
        return True

    def prepare(self, cob_ids: Sequence[int], size: int) -> Callable[[Sequence[bytes]], int]:
        return lambda payloads: sum(not self.send(i, p) for i, p in zip(cob_ids, payloads, strict=True))

    def drain(self) -> list[Frame]:
        entered = time.thread_time()
        frames = []
        while (message := self._bus.recv(timeout=0)) is not None:
            frames.append((message.arbitration_id, bytes(message.data)))
        self._drives += time.thread_time() - entered
        return frames

    def wait(self, seconds: float) -> None:
        self._bus.sleep(seconds)

    def overflows(self) -> int:
        return 0


def reference(robot: Robot, seconds: float) -> FloatArray:
    """From rest to rest, all joints swinging."""
    t = np.arange(round(seconds / robot.bus.cycle_time)) * robot.bus.cycle_time
    swing = 0.1 * (1 - np.cos(2 * np.pi * np.round(0.4 * seconds) / t[-1] * t))
    window = np.clip(np.minimum(t, t[-1] - t) / 2.0, 0.0, 1.0)
    window = window**3 * (10 - 15 * window + 6 * window**2)
    return np.asarray(np.array(robot.home) + (window * swing)[:, None] * np.ones(robot.n))


def collections_so_far() -> int:
    """Runs of the garbage collector in this process."""
    return sum(generation["collections"] for generation in gc.get_stats())


def measured(tree: Path, seconds: float) -> FloatArray:
    """Own work in a tree's cycles at 50, 99, 99.9 and 100 %, ms; in a process of its own, by this script."""
    done = subprocess.run(
        [sys.executable, "-P", str(Path(__file__).resolve()), "--seconds", f"{seconds:g}"],
        env=os.environ | {"PYTHONPATH": str(tree)},
        cwd=tree,
        capture_output=True,
        text=True,
        check=True,
    )
    found = re.search(r"own work .* %: ([\d. /]+) ms", done.stdout)
    assert found is not None, done.stdout
    return np.array([float(value) for value in found[1].split(" / ")])


def compare(before: Path, seconds: float, pairs: int) -> None:
    """Both trees in turn, the first of each pair changing; print each pair and the median of the ratios."""
    trees = (before.resolve(), Path(__file__).resolve().parents[1])
    ratios = []
    for pair in range(pairs):
        found = {tree: measured(tree, seconds) for tree in (trees if pair % 2 else trees[::-1])}
        ratios.append(found[trees[1]] / found[trees[0]])
        told = [" / ".join(f"{value:.3f}" for value in found[tree]) for tree in trees]
        print(f"before {told[0]} ms, after {told[1]} ms", flush=True)
    told = [" / ".join(f"{value:.2f}" for value in row) for row in (np.median(ratios, axis=0), *ratios)]
    print(f"ratio 50 / 99 / 99.9 / 100 %, median of {pairs} pairs: {told[0]}; each: {'; '.join(told[1:])}")


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--before", type=Path, help="another source tree, measured in turn with this one")
    parser.add_argument("--pairs", type=int, default=6)
    asked = parser.parse_args()
    if asked.before is not None:
        compare(asked.before, asked.seconds, asked.pairs)
        return 0
    robot = robots.load("tx40")
    ports: list[TimedPort] = []
    phases: list[str] = []
    turn, fall_asleep = Cycle.turn, InProcessBus.sleep

    def noted_turn(cycle: Cycle) -> None:
        caller = sys._getframe(1)
        phases.append(f"{caller.f_code.co_name} ({caller.f_globals['__name__']})")
        turn(cycle)

    def port(bus: InProcessBus) -> TimedPort:
        ports.append(TimedPort(bus))
        return ports[0]

    def sleep(bus: InProcessBus, seconds: float) -> None:
        entered = time.thread_time()
        fall_asleep(bus, seconds)  # in virtual time the drives have their heartbeats meanwhile
        if ports:
            ports[0].beside(entered)

    path, truth = reference(robot, asked.seconds), draw_truth(robot, 1)
    with (
        patch("drivers.cyclic.loop.frame_port", port),
        patch.object(Cycle, "turn", noted_turn),
        patch.object(InProcessBus, "sleep", sleep),
    ):
        realtime.freeze_heap()
        gc.disable()
        before = collections_so_far()
        result = stream_in_process(robot, truth, path).result
        collected = collections_so_far() - before
    if result is None or result.outcome != "completed":
        print(result)
        return 2
    work = 1e3 * np.array(ports[0].work[1:])
    faults, names = np.array(ports[0].page_faults[1:]), phases[1:]
    told = " / ".join(f"{value:.3f}" for value in np.percentile(work, [50, 99, 99.9, 100]))
    period = 1e3 * robot.bus.cycle_time
    print(f"{len(work)} SYNC periods of {period:g} ms; own work 50 / 99 / 99.9 / 100 %: {told} ms")
    print(
        f"{collected} garbage collections; {faults.sum()} page faults in {np.count_nonzero(faults)} periods"
    )
    for k in np.argsort(work)[::-1][:LONGEST]:
        print(f"  {work[k]:.3f} ms before SYNC {k + 1}, sent in {names[k]}, {faults[k]} page faults")
    return 0


if __name__ == "__main__":
    sys.exit(main())
