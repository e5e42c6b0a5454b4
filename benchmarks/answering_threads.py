"""How many threads should make answers? Processor time of an answer and memory by their number.

    PYTHONPATH=. python benchmarks/answering_threads.py [--seconds 4] [--rounds 2]

``armhil serve`` with each number of threads in turn, asked by 24 clients at once. Others may
use the machine: processor time is what an answer costs, the clock only what it cost there and then.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

from live_clients import processor_seconds

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from daq.catalogue.database import Catalogue
from tests.daq.service.filled import fill

THREADS = (1, 2, 4, 8, 16, 40)
CLIENTS = 24
PATHS = ("/", "/metrics", "/arms/emps-sim", "/runs/12", "/api/runs")
_SERVE = """
import sys
import daq.service.app as app
from daq.cli import entry
app.ANSWERING, sys.argv = int(sys.argv[1]), ["armhil", "serve", "--port", "0"]
entry.main()
"""


def measure(threads: int, seconds: float) -> dict[str, float]:
    """One service, asked by all clients for so long."""
    command = [sys.executable, "-c", _SERVE, str(threads)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    address = process.stderr.readline().split()[-1].rstrip("/")
    threading.Thread(target=process.stderr.read, daemon=True).start()
    took: list[float] = []

    def ask(number: int, until: float) -> None:
        while time.monotonic() < until:
            begun = time.monotonic()
            path = PATHS[(number + len(took)) % len(PATHS)]
            with urllib.request.urlopen(address + path, timeout=60) as answer:
                answer.read()
            took.append(time.monotonic() - begun)

    try:
        for path in PATHS:
            urllib.request.urlopen(address + path, timeout=60).read()
        used = processor_seconds(process.pid)
        until = time.monotonic() + seconds
        clients = [threading.Thread(target=ask, args=(number, until)) for number in range(CLIENTS)]
        for client in clients:
            client.start()
        for client in clients:
            client.join()
        used = processor_seconds(process.pid) - used
        status = Path(f"/proc/{process.pid}/status").read_text()
    finally:
        process.terminate()
        process.wait()
    return {
        "answers": len(took),
        "processor_ms": 1e3 * used / len(took),
        "median_s": statistics.median(took),
        "memory_mb": int(status.partition("VmHWM:")[2].split()[0]) / 1024,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--rounds", type=int, default=2)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        os.environ |= {
            "ARMHIL_CATALOGUE": str(Path(name) / "catalogue.db"),
            "ARMHIL_SERVICE": f"{name}/none.toml",
        }
        with Catalogue() as catalogue:
            fill(catalogue, Path(name))
        for _ in range(given.rounds):
            for threads in THREADS:
                print(json.dumps({"threads": threads, **measure(threads, given.seconds)}), flush=True)


if __name__ == "__main__":
    main()
