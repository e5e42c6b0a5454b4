"""What recording costs: processor time per sample and memory over time, at 1 kHz with all raw frames.

    python benchmarks/recording_load.py --seconds 1800 --out FOLDER

A source in a process of its own puts on a multicast bus what six axes put on theirs at 1 kHz (SYNC, six
RPDOs, six TPDOs, heartbeats: 13 frames a millisecond), and the recorder takes them down beside the samples of
the cycles, as in a run. Its own processor time and its resident memory are printed at each tenth of the time.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import time
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np

import robots
from daq.recording.capture import DESCRIPTION, RUN, TRAJECTORY
from daq.recording.listener import FrameListener
from daq.recording.recorder import Recorder
from daq.recording.topics import FRAMES_TOPIC
from drivers import Channel, Samples, open_bus
from drivers.bus.ports import frame_port

PERIOD = 0.001
BATCH = 0.05
"""s between two batches of samples, as the parent of a stream fetches them."""


def source(channel: Channel, nodes: list[int], ended: Event) -> None:
    """Keep 1 kHz on the average; after a pause of the machine the missed cycles follow at once."""
    with open_bus(channel) as bus:
        port = frame_port(bus)
        rpdos = port.prepare([0x200 + node for node in nodes], 6)
        tpdos = port.prepare([0x180 + node for node in nodes], 8)
        begin, cycle = time.monotonic(), 0
        while not ended.is_set():
            counts = (1e5 * np.sin(cycle * PERIOD + np.arange(len(nodes)))).astype("<i4")
            words = [row.tobytes() for row in counts]
            port.send(0x080, b"")
            rpdos([b"\x0f\x00" + word for word in words])
            tpdos([b"\x37\x12" + word + word[:2] for word in words])
            if cycle % 100 == 0:
                port.send(0x77F, b"\x05")
            cycle += 1
            time.sleep(max(0.0, begin + cycle * PERIOD - time.monotonic()))


def samples(first: int, count: int, joints: int) -> Samples:
    """Cycles of a motion that does not repeat within the batch; encoder noise makes it hard to compress."""
    cycle = np.arange(first, first + count)
    phase = cycle[:, np.newaxis] * PERIOD + np.arange(joints)
    noise = np.random.default_rng(first).normal(scale=1e-6, size=(count, joints))
    return Samples(
        cycle=cycle,
        time=cycle * PERIOD,
        reference=np.sin(phase),
        position=np.sin(phase - 0.01) + noise,
        control_signal=np.cos(phase) + 1e3 * noise,
        statusword=np.full((count, joints), 0x1237, dtype=np.uint16),
        complete=np.ones((count, joints), dtype=np.bool_),
        lateness=1e-5 * np.abs(noise[:, 0]),
    )


def resident_megabytes() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=1800.0)
    parser.add_argument("--out", type=Path, required=True, help="folder for the capture, which is removed")
    parser.add_argument("--without-frames", action="store_true")
    options = parser.parse_args()
    robot = robots.load("tx40")
    channel = Channel("udp_multicast", "239.74.250.9:23456")
    ended = multiprocessing.Event()
    nodes = [drive.node_id for drive in robot.drive]
    sending = multiprocessing.Process(target=source, args=(channel, nodes, ended), daemon=True)
    if not options.without_frames:
        sending.start()
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "load.mcap"
    path.unlink(missing_ok=True)
    try:
        record(path, robot, channel, options.seconds)
    finally:
        ended.set()
        if sending.is_alive():
            sending.join()
        path.unlink(missing_ok=True)


def record(path: Path, robot: robots.Robot, channel: Channel, seconds: float) -> None:
    facts = {
        DESCRIPTION: {
            "name": robot.name,
            "robot.toml": robot.source_text,
            "urdf": robot.urdf_path.read_text(encoding="utf-8"),
            "joints": "\n".join(joint.name for joint in robot.joint),
        },
        RUN: {"period": repr(PERIOD)},
        TRAJECTORY: {"family": "benchmark"},
    }
    count = round(BATCH / PERIOD)
    with FrameListener(channel) as listener, Recorder(path, robot, facts, listener=listener) as recorder:
        cycle, begin, spent, making = 0, time.monotonic(), time.process_time(), 0.0
        marks = [seconds * tenth / 10 for tenth in range(1, 11)]
        while marks:
            before = time.process_time()
            batch = samples(cycle, count, robot.n)
            making += time.process_time() - before
            recorder.write(batch)
            cycle += count
            time.sleep(max(0.0, begin + cycle * PERIOD - time.monotonic()))
            if time.monotonic() - begin >= marks[0]:
                marks.pop(0)
                elapsed = time.monotonic() - begin
                cost = time.process_time() - spent - making
                line = {
                    "seconds": round(elapsed, 1),
                    "cycles": cycle,
                    "frames": recorder.counts[FRAMES_TOPIC],
                    "frames_dropped": listener.dropped,
                    "cpu_us_per_cycle": round(1e6 * cost / cycle, 2),
                    "share_of_a_core_percent": round(100 * cost / elapsed, 2),
                    "resident_mb": round(resident_megabytes(), 1),
                    "file_mb": round(path.stat().st_size / 1e6, 1),
                }
                print(json.dumps(line), flush=True)
        recorder.finish({"outcome": "completed", "reason": "", "cycles": str(cycle)})


if __name__ == "__main__":
    main()
