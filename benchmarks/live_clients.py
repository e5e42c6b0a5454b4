"""Do those who look on cost a cycle? A run at 250 Hz with many on its live stream, and the same without.

    PYTHONPATH=. python benchmarks/live_clients.py [--clients 50] [--seconds 60] [--repeats 3]

Six axes are streamed over UDP on the loopback interface, recorded and kept as ``armhil run`` does, while
``armhil serve`` shows them to the clients over HTTP, all of them in one process. The control is the same run
with service and nobody who looks on. A witness of the machine itself (``machine_stalls.py``) tells deadlines
that were missed while no process could run apart from the others.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from cyclic import own_failures, skipped
from machine_stalls import witness

import robots
from daq.catalogue.database import Catalogue
from daq.session.bench import ArmOrder, opened
from daq.session.recorded_runs import Recording, unconducted
from daq.session.states import Conduct
from daq.text.progress import Silent
from drivers import Channel, Samples, StreamResult
from trajectories import Trajectory, plan

CHANNEL = Channel("udp_multicast", "239.74.200.9:29873")
DURATION = 12.0
SUBSCRIBERS = Path(__file__).with_name("subscribers.py")


class Watching:
    """Keeps the samples, and knows when the first one was."""

    def __init__(self, period: float) -> None:
        self.batches: list[Samples] = []
        self.began = float("inf")
        self._period = period
        self._missed = 0

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """A stream is about to start."""

    def samples(self, samples: Samples) -> None:
        """Samples have come."""
        if len(samples):
            self.batches.append(samples)
            self._missed += int(skipped(samples, self._period).sum())
            first = time.monotonic() - (int(samples.cycle[-1]) + self._missed) * self._period
            self.began = min(self.began, first)

    def end(self, result: StreamResult | None) -> None:
        """It is over."""


@contextmanager
def service(catalogue: Path | str) -> Iterator[tuple[int, int]]:
    """``armhil serve``: its port and process id."""
    process = subprocess.Popen(
        [sys.executable, "-m", "daq", "serve", "--port", "0"],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"ARMHIL_CATALOGUE": str(catalogue)},
    )
    assert process.stderr is not None
    said = process.stderr.readline()
    # A pipe that nobody reads would hold it up as soon as 64 kB were logged.
    threading.Thread(target=process.stderr.read, daemon=True).start()
    try:
        yield int(said.rsplit(":", 1)[1].partition("/")[0]), process.pid
    finally:
        process.terminate()
        process.wait()


def processor_seconds(pid: int) -> float:
    """What a process has used so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def measure(motion: Trajectory, folder: Path, clients: int) -> None:
    """One run with so many who look on; prints what came of it."""
    robot = robots.load("tx40")
    folder.mkdir()
    looking: list[subprocess.Popen[str]] = []

    class Starting(Watching):
        """The clients come when the run is in the catalogue, just before it moves."""

        def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
            if clients:
                words = [sys.executable, str(SUBSCRIBERS), str(port), "1", str(clients)]
                looking.append(subprocess.Popen(words, stdout=subprocess.PIPE, text=True))

    watching = Starting(robot.bus.cycle_time)
    order = ArmOrder(robot, "tx40", CHANNEL, simulated=True, seed=1)
    with (
        witness() as stalls,
        Catalogue(str(folder / "catalogue.db")) as catalogue,
        service(folder / "catalogue.db") as (port, pid),
        opened(order, catalogue, Silent(), "drive") as arm,
    ):
        before = processor_seconds(pid)
        recording = Recording(arm, order, catalogue, watching, unconducted)
        _, result = recording.record("run", "Live clients", motion, folder / "capture.mcap")
        used = processor_seconds(pid) - before
        looked = [json.loads(process.communicate()[0]) for process in looking]
    samples = Samples.concatenate(watching.batches)
    own = own_failures(samples, robot.bus.cycle_time, watching.began, stalls)
    late = 1e3 * np.percentile(samples.lateness, [50, 99, 99.9, 100])
    length = len(motion.time) * robot.bus.cycle_time
    print(
        f"{clients:3d} clients: {result.outcome}, {result.cycles} cycles, {result.missed_cycles} missed"
        f" ({own[0]} of them outside of {len(stalls)} stalls of the machine), {result.late_cycles} late,"
        f" {result.incomplete_cycles} incomplete; lateness 50 / 99 / 99.9 / 100 % "
        + " / ".join(f"{value:.3f}" for value in late)
        + f" ms; service {100 * used / length:.1f} % of a core",
        flush=True,
    )
    for seen in looked:
        rate = np.array(seen["samples"]) / length
        print(
            f"             {len(rate)} served to the end, {rate.min():.1f} to {rate.max():.1f} samples a"
            f" second each, {seen['bytes'] / length / 1e3:.0f} kB/s in all; the clients themselves"
            f" {100 * seen['seconds'] / length:.1f} % of a core",
            flush=True,
        )


def motion_of(seconds: float) -> Trajectory:
    """Of a TX40, from home and back, so many whole periods that it lasts about as long."""
    robot = robots.load("tx40")
    return plan(
        robot,
        cycle_time=robot.bus.cycle_time,
        duration=DURATION,
        periods=max(1, round(seconds / DURATION)),
        seed=0,
        evaluations=300,
        start=np.array(robot.home),
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--repeats", type=int, default=3, help="pairs of runs, without and with clients")
    given = parser.parse_args()
    print(f"load of this machine before: {os.getloadavg()[0]:.2f} on {os.cpu_count()} cores")
    motion = motion_of(given.seconds)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(given.repeats):
            for clients in (0, given.clients):
                measure(motion, Path(folder) / f"{number}-{clients}", clients)
    print(f"load of this machine after: {os.getloadavg()[0]:.2f}")


if __name__ == "__main__":
    main()
