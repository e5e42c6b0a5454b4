"""The cyclic process on this machine: punctuality and processor time at 250 and 500 Hz, six axes.

    PYTHONPATH=. python benchmarks/cyclic.py [--seconds 60] [--busy] [--rates 250 500]

Streams to the simulated drives over UDP on the loopback interface, with ``--busy`` beside one busy process on
each core. Then a loop of python-can alone exchanges the same frames at the same rate with the same drives:
no checks, no state machine, no record. The ratio is the processor time of the whole cyclic process over that
loop's. Beside it all runs a witness of the machine itself (``machine_stalls.py``): deadlines that
were missed while even a process above all others could not run are told apart from the others.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import can
import numpy as np
from machine_stalls import SHORTEST, Stall, covered, stolen_seconds, witness

import robots
from drivers import ArmSession, Channel, Samples, StreamResult, open_bus
from drivers.cyclic import realtime
from drivers.frames.layout import rpdo_cob_id, tpdo_cob_id
from drivers.simulated import SimulatedArm
from robots import Robot

CHANNEL = Channel("udp_multicast", "239.74.200.7:29871")


@dataclass(frozen=True)
class Raw:
    """What the bare loop of python-can did."""

    cycles: int
    incomplete: int
    cpu_share: float


@contextlib.contextmanager
def busy_processes(wanted: bool) -> Iterator[None]:
    """One endless loop on each core while the block runs."""
    count = (os.cpu_count() or 1) if wanted else 0
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def stream(robot: Robot, seconds: float) -> tuple[StreamResult, Samples, float]:
    """One stream through session, cyclic process and simulated drives; and when its first row was, s."""
    batches = [Samples.empty(robot.n)]
    period = robot.bus.cycle_time
    began, missed = float("inf"), 0

    def keep(samples: Samples) -> None:
        nonlocal began, missed
        # A batch is fetched after its last row: the one fetched soonest says best when the rows were.
        batches.append(samples)
        missed += int(skipped(samples, period).sum())
        began = min(began, time.monotonic() - (int(samples.cycle[-1]) + missed) * period)

    with SimulatedArm("tx40", CHANNEL, seed=1), ArmSession(robot, CHANNEL) as session:
        start = session.actual_position()
        t = np.arange(round(seconds / robot.bus.cycle_time)) * robot.bus.cycle_time
        swing = 0.2 * (1 - np.cos(2 * np.pi * np.round(0.4 * seconds) / t[-1] * t))
        window = np.clip(np.minimum(t, t[-1] - t) / 2.0, 0.0, 1.0)
        window = window**3 * (10 - 15 * window + 6 * window**2)
        result = session.stream(start + 0.5 * (window * swing)[:, None] * np.ones(robot.n), keep)
    return result, Samples.concatenate(batches), began


def skipped(samples: Samples, period: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Deadlines that were missed just before each row, (N,)."""
    # As the pacemaker counts them: one more for each period, from three quarters of the first on.
    return np.floor(np.maximum(samples.lateness, 0.0) / period + 0.25).astype(np.int64)


def moments(samples: Samples, period: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """When each row's SYNC was, s after the first one's deadline, (N,)."""
    return (samples.cycle + np.cumsum(skipped(samples, period))) * period


def own_failures(samples: Samples, period: float, began: float, stalls: list[Stall]) -> tuple[int, int]:
    """Missed deadlines and late SYNCs outside the machine's own stalls."""
    missed = skipped(samples, period)
    late = samples.lateness - missed * period > 0.5 * period
    when = began + moments(samples, period)
    # The moments are known to a few milliseconds; the deadlines of a row lie before it.
    own = [
        k
        for k in np.flatnonzero((missed > 0) | late)
        if not covered(when[k] - 0.5 * missed[k] * period, stalls, 0.5 * missed[k] * period + 0.005)
    ]
    return int(missed[own].sum()), int(late[own].sum())


def raw_loop(period: float, seconds: float, nodes: tuple[int, ...]) -> Raw:
    """SYNC, the TPDOs, the RPDOs: python-can alone, in this process."""
    wanted = {tpdo_cob_id(node) for node in nodes}
    sync = can.Message(arbitration_id=0x080, is_extended_id=False)
    rpdos = [can.Message(arbitration_id=rpdo_cob_id(n), is_extended_id=False, data=bytes(6)) for n in nodes]
    incomplete = 0
    cycles = round(seconds / period)
    with open_bus(CHANNEL, wanted) as bus:
        realtime.prepare()
        gc.disable()
        began = time.monotonic(), time.process_time()
        for cycle in range(1, cycles + 1):
            if (left := began[0] + cycle * period - time.monotonic()) > 0:
                time.sleep(left)
            bus.send(sync)
            until = time.monotonic() + max(0.6 * period, 0.03)
            heard: set[int] = set()
            while len(heard) < len(nodes) and (left := until - time.monotonic()) > 0:
                message = bus.recv(left)
                if message is not None:
                    heard.add(message.arbitration_id)
            incomplete += len(heard) < len(nodes)
            for message in rpdos:
                bus.send(message)
        share = (time.process_time() - began[1]) / (time.monotonic() - began[0])
    return Raw(cycles, incomplete, share)


def _raw_in_process(period: float, seconds: float, nodes: tuple[int, ...], answer: object) -> None:
    answer.send(raw_loop(period, seconds, nodes))  # type: ignore[attr-defined]


def raw(robot: Robot, seconds: float) -> Raw:
    """The bare loop, in a fresh process, with operational drives that stay disabled."""
    nodes = tuple(drive.node_id for drive in robot.drive)
    with SimulatedArm("tx40", CHANNEL, seed=1):
        with open_bus(CHANNEL, []) as bus:
            bus.send(can.Message(arbitration_id=0, data=b"\x01\x00", is_extended_id=False))
        ours, theirs = multiprocessing.Pipe()
        context = multiprocessing.get_context("spawn")
        process = context.Process(target=_raw_in_process, args=(robot.bus.cycle_time, seconds, nodes, theirs))
        process.start()
        result: Raw = ours.recv()
        process.join()
    return result


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--busy", action="store_true")
    parser.add_argument("--rates", type=int, nargs="+", default=[250, 500])
    options = parser.parse_args()
    print(f"load of this machine before: {os.getloadavg()[0]:.2f} on {os.cpu_count()} cores")
    bad = False
    for rate in options.rates:
        arm = robots.load("tx40")
        # 500 Hz would fill a real bus of 1 Mbit/s by 81 %: here the machine is measured, not the wire.
        bus = arm.bus.model_copy(update={"cycle_time": 1 / rate, "load_limit": 1.0})
        arm = arm.model_copy(update={"bus": bus})
        with busy_processes(options.busy):
            stolen = stolen_seconds()
            with witness() as stalls:
                result, samples, began = stream(arm, options.seconds)
            stolen = stolen_seconds() - stolen
            bare = raw(arm, min(options.seconds, 20.0))
        late = 1e3 * np.percentile(samples.lateness, [50, 99, 99.9, 100])
        cycles = max(1, result.cycles)
        print(
            f"{rate} Hz{', busy' if options.busy else ''}: {result.outcome}, {result.cycles} cycles, "
            f"{result.missed_cycles} deadlines missed, {result.late_cycles} late "
            f"({100 * result.late_cycles / cycles:.3f} %), {result.incomplete_cycles} incomplete, "
            f"{result.overflows} frames lost"
        )
        period = arm.bus.cycle_time
        longest = max((end - begin for begin, end in stalls), default=0.0)
        own = own_failures(samples, period, began, stalls)
        print(
            f"  stalls of the machine above {1e3 * SHORTEST:g} ms: {len(stalls)}, longest "
            f"{1e3 * longest:.1f} ms; outside of them {own[0]} deadlines missed, {own[1]} late; "
            f"{stolen:.2f} s of processor time taken by the host"
        )
        causes = ", ".join(f"{count} {cause}" for cause, count in result.missed_for.items())
        print(f"  deadlines missed by cause: {causes}")
        print("  lateness 50 / 99 / 99.9 / 100 %: " + " / ".join(f"{value:.3f}" for value in late) + " ms")
        print(
            f"  processor: {100 * result.cpu_share:.1f} % of a core; python-can alone "
            f"{100 * bare.cpu_share:.1f} % ({bare.incomplete} of {bare.cycles} incomplete); "
            f"ratio {result.cpu_share / bare.cpu_share:.2f}"
        )
        bad = bad or result.outcome != "completed"
    print(f"load of this machine after: {os.getloadavg()[0]:.2f}")
    return 2 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
