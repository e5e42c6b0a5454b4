"""The demonstration over a real vcan0 in virtual time: how fast, and is it the same each time?

    PYTHONPATH=. python benchmarks/virtual_time.py [--runs 2] [--duration 12] [--periods 2] [--real]

Runs ``armhil demo`` on SocketCAN inside a user-mode kernel whose clock advances by sleeping alone
(``../shared/tools/vcan/vcan-run -v``; needs root), and prints for each run the seconds that were streamed,
the seconds that passed on the virtual clock, and the wall and processor seconds that it took, planning,
identification and report included. Processor seconds are honest on a busy machine, too; wall seconds are not.
Then it compares the captures: samples and raw frames to the last bit, their time stamps beside.
``--real`` runs the same once in real time over UDP, for comparison.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daq.recording.reader import read_capture, read_frames

ROOT = Path(__file__).resolve().parents[1]
TOOL = ROOT.parent / "shared" / "tools" / "vcan" / "vcan-run"
TIMED = (
    "import subprocess, sys, time; began = time.monotonic(); code = subprocess.call(sys.argv[2:]);"
    " open(sys.argv[1], 'w').write(str(time.monotonic() - began)); sys.exit(code)"
)
"""A program that runs another one and writes down how long that took on the clock that it sees."""
COLUMNS = ("cycle", "reference", "position", "control_signal", "statusword", "complete")
FRAME_COLUMNS = ("can_id", "is_rtr", "is_extended", "is_error", "dlc", "data")


@dataclass(frozen=True)
class Taken:
    """What one run took, s."""

    clock: float
    """On the clock that the run itself saw."""
    wall: float
    processor: float


def run(out: Path, options: list[str], *before: str) -> Taken:
    """One demonstration into a folder that does not exist yet."""
    clock = out.with_suffix(".clock")
    earlier, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(
        [
            *before,
            sys.executable,
            "-c",
            TIMED,
            str(clock),
            sys.executable,
            "-m",
            "daq",
            "demo",
            *options,
            "--out",
            str(out),
        ],
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    wall, later = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 1):  # 1: a verdict that warns
        raise SystemExit(done.stdout + done.stderr)
    processor = later.ru_utime + later.ru_stime - earlier.ru_utime - earlier.ru_stime
    return Taken(float(clock.read_text(encoding="ascii")), wall, processor)


def differences(first: Path, second: Path) -> list[str]:
    """What is not the same to the last bit in two captures; time stamps are left out."""
    a, b = read_capture(first).samples, read_capture(second).samples
    found = [name for name in COLUMNS if not np.array_equal(getattr(a, name), getattr(b, name))]
    frames, others = read_frames(first), read_frames(second)
    if len(frames) != len(others):
        return [*found, f"{len(frames)} and {len(others)} frames"]
    return found + [
        name for name in FRAME_COLUMNS if not np.array_equal(getattr(frames, name), getattr(others, name))
    ]


def stamp_distance(first: Path, second: Path) -> float:
    """Largest difference between the raw frames' times since the first of them, s."""
    a, b = (read_frames(path).stamp for path in (first, second))
    return float(np.abs((a - a[0]) - (b - b[0])).max()) * 1e-9


def main() -> int:
    """Measure and print; 2 where two runs differ."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--runs", type=int, default=2)
    parser.add_argument("--duration", type=float, default=12.0)
    parser.add_argument("--periods", type=int, default=2)
    parser.add_argument("--evaluations", type=int, default=6000)
    parser.add_argument("--real", action="store_true")
    asked = parser.parse_args()
    options = ["--seed", "6", "--no-catalogue", "--duration", f"{asked.duration:g}"]
    options += ["--periods", str(asked.periods), "--evaluations", str(asked.evaluations)]
    print(f"load of this machine before: {os.getloadavg()[0]:.2f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as folder:
        captures = []
        for number in range(asked.runs):
            out = Path(folder) / f"run-{number}"
            on_vcan = [*options, "--interface", "socketcan", "--channel", "vcan0"]
            taken = run(out, on_vcan, str(TOOL), "-v", "--")
            captures.append(out / "capture.mcap")
            tell("virtual time", taken, captures[-1])
        if asked.real:
            out = Path(folder) / "real"
            taken = run(out, [*options, "--channel", "239.74.200.9:29873"])
            tell("real time, UDP", taken, out / "capture.mcap")
        differing = sorted({what for other in captures[1:] for what in differences(captures[0], other)})
        for other in captures[1:]:
            apart = 1e6 * stamp_distance(captures[0], other)
            print(f"time stamps of the raw frames are up to {apart:.1f} µs apart")
        if len(captures) > 1:
            print("samples and raw frames:", ", ".join(differing) or "the same to the last bit")
    return 2 if differing else 0


def tell(how: str, taken: Taken, capture: Path) -> None:
    """One line for a run."""
    found = read_capture(capture)
    print(
        f"{how}: {len(found.samples) * found.period:.1f} s streamed, {taken.clock:.1f} s on its clock, "
        f"{taken.wall:.1f} s of wall time, {taken.processor:.1f} s of processor time"
    )


if __name__ == "__main__":
    sys.exit(main())
