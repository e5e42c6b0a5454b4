"""A log of hours, six axes at 1 kHz, identified with its URDF alone: memory and time against its length.

The log is made with pinocchio of the TX40's links, friction, rotors and noise, and written as .npz. Memory is
that of the command and the process that reads for it, together; so is processor time, beside the time from
start to end, which other work of the machine prolongs.

    python -m benchmarks.long_log --hours 0.5 1 2
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pinocchio

from robots.arrays import FloatArray

ROOT = Path(__file__).parents[1]
URDF = ROOT / "robots" / "tx40" / "tx40.urdf"
RATE, MOTION = 1000, 600
"""Samples per second, and s after which the motion repeats."""


def motion() -> tuple[FloatArray, FloatArray]:
    """Positions and torques of one period, samples × 6."""
    model = pinocchio.buildModelFromUrdf(str(URDF))
    data, lot = model.createData(), np.random.default_rng(1)
    t = np.arange(MOTION * RATE) / RATE
    q = np.tile(np.array([0, 0.2, 1.2, 0, 0.5, 0]), (t.size, 1))
    v, a = np.zeros_like(q), np.zeros_like(q)
    for j in range(6):
        for tone in lot.choice(np.arange(60, 900), 8, replace=False):
            w, phase, size = 2 * np.pi * tone / MOTION, lot.uniform(0, 6.28), 0.12 * lot.uniform(0.5, 1.0)
            q[:, j] += size * np.sin(w * t + phase)
            v[:, j] += size * w * np.cos(w * t + phase)
            a[:, j] -= size * w**2 * np.sin(w * t + phase)
    torque = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    return q, torque + 0.3 * a + 2.0 * v + 3.0 * np.tanh(v / 0.005)


def write_log(path: Path, hours: float, q: FloatArray, torque: FloatArray) -> None:
    """Periods of the motion one after the other, each with noise of its own."""
    count, lot = round(hours * 3600 * RATE), np.random.default_rng(2)
    position, effort = np.empty((count, 6)), np.empty((count, 6))
    for first in range(0, count, len(q)):
        last = min(first + len(q), count)
        noise = lot.standard_normal((2, last - first, 6))
        position[first:last] = q[: last - first] + 1e-6 * noise[0]
        effort[first:last] = torque[: last - first] + 0.02 * np.std(torque, axis=0) * noise[1]
    np.savez(path, t=np.arange(count) / RATE, q=position, tau=effort)


def measured(log: Path) -> dict[str, float]:
    """The command's time and processor time, s, and the largest memory of it and its children, MiB."""
    command = [
        sys.executable,
        "-m",
        "daq",
        "identify",
        str(log),
        "--urdf",
        str(URDF),
        "--no-catalogue",
        "--json",
    ]
    begin, used = time.monotonic(), _processor()
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        peak = 0
        while process.poll() is None:
            peak = max(peak, sum(_resident(pid) for pid in _tree(process.pid)))
            time.sleep(0.05)
        answer = json.loads(process.stdout.read())
    seconds = time.monotonic() - begin
    found = {p["name"]: p["value"] for p in answer["estimates"]["ls"]["parameters"]}
    return {
        "seconds": round(seconds, 1),
        "processor": round(_processor() - used, 1),
        "peak_mib": round(peak / 1024),
        "Fv1": found["Fv1"],
        "Fc1": found["Fc1"],
    }


def _processor() -> float:
    """s, of all processes that were begun here and have ended."""
    spent = os.times()
    return spent.children_user + spent.children_system


def _tree(pid: int) -> list[int]:
    """A process and those below it."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()
    except OSError:
        return []
    return [pid, *(below for child in children for below in _tree(int(child)))]


def _resident(pid: int) -> int:
    """KiB."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) for line in lines if line.startswith("VmRSS")), 0)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, nargs="+", default=[0.5, 1.0, 2.0])
    hours = parser.parse_args().hours
    period = motion()
    with TemporaryDirectory() as folder:
        for length in hours:
            log = Path(folder) / "log.npz"
            write_log(log, length, *period)
            print(json.dumps({"hours": length, **measured(log)}), flush=True)


if __name__ == "__main__":
    main()
