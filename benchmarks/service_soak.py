"""Ten minutes of everything at once beside a 250 Hz run: does the service stay flat, and the run on time?

    PYTHONPATH=. python benchmarks/service_soak.py [--seconds 600] [--requests 20000] [--seed 0] [--alone]

Six axes are streamed, recorded and kept as ``armhil run`` does. Beside that ``armhil serve`` gets mixed
requests, schemathesis' cases of its own OpenAPI description, 300 live clients (200 have room), and idle,
slow and deaf connections (``service_soak_clients.py``). Its memory and open files are read every 5 s. A
witness of the machine (``machine_stalls.py``) tells deadlines that were missed while no process could run
from the others.
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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from cyclic import moments, own_failures, skipped
from live_clients import CHANNEL, Watching, motion_of, processor_seconds, service
from machine_stalls import witness

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import robots
from daq.catalogue.database import Catalogue
from daq.session.bench import ArmOrder, opened
from daq.session.recorded_runs import Recording, unconducted
from daq.session.states import Conduct
from daq.text.progress import Silent
from drivers import Samples
from tests.daq.service.filled import fill
from trajectories import Trajectory

TOKEN = "drive-token-of-the-soak"
CLIENTS, CASES = (
    Path(__file__).with_name(name) for name in ("service_soak_clients.py", "service_soak_cases.py")
)


@dataclass(frozen=True)
class Look:
    """At a process.

    Attributes:
        at: s since the first look.
        memory: resident, MB.
        files: that are open.
        waited: s that its first thread, which accepts and cuts, wanted a processor and had none.
    """

    at: float
    memory: float
    files: int
    waited: float


class Sampler(threading.Thread):
    """Looks at a process every few seconds until it is told to stop."""

    def __init__(self, pid: int, interval: float = 5.0) -> None:
        super().__init__(daemon=True)
        self.looks: list[Look] = []
        self.over = threading.Event()
        self._pid, self._interval = pid, interval

    def run(self) -> None:
        """Look."""
        begun = time.monotonic()
        while not self.over.wait(self._interval):
            status = Path(f"/proc/{self._pid}/status").read_text()
            memory = int(status.partition("VmRSS:")[2].split()[0]) / 1024
            files = len(list(Path(f"/proc/{self._pid}/fd").iterdir()))
            waited = int(Path(f"/proc/{self._pid}/schedstat").read_text().split()[1]) / 1e9
            self.looks.append(Look(time.monotonic() - begun, memory, files, waited))


def memory_of(looks: list[Look]) -> dict[str, float]:
    """Median resident memory of the second and of the last minute, MB, the largest, and the course between.

    The first minute fills caches; ``per_minute`` is the slope of a line through the rest, MB a minute.
    """
    at, memory = (np.array([getattr(look, name) for look in looks]) for name in ("at", "memory"))
    late = at > 60.0
    return {
        "second_minute": float(np.median(memory[late & (at <= 120.0)])),
        "last_minute": float(np.median(memory[at > at[-1] - 60.0])),
        "largest": float(memory.max()),
        "per_minute": 60.0 * float(np.polyfit(at[late], memory[late], 1)[0]),
        "files_at_most": max(look.files for look in looks),
        "waited": looks[-1].waited - looks[0].waited,
        "waited_of_ten_seconds": max(b.waited - a.waited for a, b in zip(looks, looks[2:], strict=False)),
    }


def soak(motion: Trajectory, folder: Path, requests: int, seed: int, *, alone: bool) -> dict[str, Any]:
    """One run with everything beside it, or with a service that nobody asks."""
    robot = robots.load("tx40")
    length = len(motion.time) * robot.bus.cycle_time
    processes: list[subprocess.Popen[str]] = []

    class Starting(Watching):
        """Everybody comes when the run is in the catalogue, just before it moves."""

        def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
            run = str(nights + 1)
            commands = (
                [str(CLIENTS), str(port), run, str(length), str(requests), str(seed)],
                [str(CASES), str(port), TOKEN, str(0.8 * length), str(seed)],
            )
            processes.extend(
                subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True)
                for words in (() if alone else commands)
            )

    nights = 12
    watching = Starting(robot.bus.cycle_time)
    order = ArmOrder(robot, "tx40", CHANNEL, simulated=True, seed=1)
    with Catalogue(str(folder / "catalogue.db")) as catalogue:
        fill(catalogue, folder, nights)
        with (
            witness() as stalls,
            service(folder / "catalogue.db") as (port, pid),
            opened(order, catalogue, Silent(), "drive") as arm,
        ):
            before = processor_seconds(pid)
            sampler = Sampler(pid)
            sampler.start()
            recording = Recording(arm, order, catalogue, watching, unconducted)
            _, result = recording.record("run", "Soak", motion, folder / "capture.mcap")
            answers = [json.loads(process.communicate()[0] or "null") for process in processes]
            sampler.over.set()
            sampler.join()
            used = processor_seconds(pid) - before
    samples = Samples.concatenate(watching.batches)
    own = own_failures(samples, robot.bus.cycle_time, watching.began, stalls)
    missed = skipped(samples, robot.bus.cycle_time)
    when = moments(samples, robot.bus.cycle_time)
    return {
        "run": {
            "outcome": str(result.outcome),
            "cycles": result.cycles,
            "missed": result.missed_cycles,
            "missed_for": result.missed_for,
            "missed_outside_of_stalls": own[0],
            "missed_at": [[round(when[k], 2), int(missed[k])] for k in np.flatnonzero(missed)],
            "late": result.late_cycles,
            "late_outside_of_stalls": own[1],
            "incomplete": result.incomplete_cycles,
            "lateness_ms": [float(v) for v in 1e3 * np.percentile(samples.lateness, [50, 99, 99.9, 100])],
            "stalls_of_the_machine": len(stalls),
            "notes": result.notes,
            "processor_share": result.cpu_share,
        },
        "service": {
            **memory_of(sampler.looks),
            "course": [[round(look.at), round(look.memory, 1)] for look in sampler.looks[::12]],
            "processor": used,
            "seconds": sampler.looks[-1].at,
        },
        **dict(zip(("clients", "schemathesis"), answers, strict=False)),
    }


def main() -> None:
    """Soak and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--requests", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0, help="of the mixed requests and cases")
    parser.add_argument("--alone", action="store_true", help="the control: nobody asks the service")
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args()
    motion = motion_of(given.seconds)
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        settings = folder / "service.toml"
        settings.write_text('format = 1\ndrive = true\ndrive_token_env = "SOAK_TOKEN"\n')
        os.environ |= {
            "SOAK_TOKEN": TOKEN,
            "ARMHIL_SERVICE": str(settings),
            "ARMHIL_FLEET": str(folder / "none.toml"),
        }
        found = soak(motion, folder, given.requests, given.seed, alone=given.alone)
    found["load_of_the_machine"] = [load, os.getloadavg()[0]]
    text = json.dumps(found, indent=1)
    if given.json is not None:
        given.json.write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
