"""Two hours of recorder, browser and checks on one machine: does anything grow, break or miss a cycle?

    python -m benchmarks.soak --hours 2 --out FOLDER
    python -m benchmarks.soak --page FOLDER          # what FOLDER has come to, as Markdown

Recorder: one process opens a simulated TX40 once and streams and records at 250 Hz, motion of ten minutes
after motion of ten minutes. Service: one ``armhil serve``. Browser: one headless Chromium that looks on live,
and between two motions walks through the pages. Checks: ``armhil check`` of a second arm every few minutes,
after its first model was accepted. Once a minute the proportional memory of each process, the browser's heap
and nodes, and the capture's size are written down.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

import robots
from benchmarks.soak_page import page
from daq.catalogue.database import Catalogue
from daq.session.bench import ArmOrder, opened
from daq.session.recorded_runs import Recording, unconducted
from daq.session.states import Conduct
from daq.text.progress import Silent
from drivers import Channel, Samples, StreamResult
from robots.errors import UserError
from tests.daq.service.browser import Browser, browsing, chromium
from trajectories import Trajectory, plan

TX40 = Channel("udp_multicast", "239.74.200.31:29931")
EMPS = "239.74.200.32:29932"
MINUTE, BETWEEN_CHECKS = 60.0, 300.0


class Soak:
    """Where it writes, and when it ends.

    Args:
        folder: for everything.
        seconds: that it lasts.
    """

    def __init__(self, folder: Path, seconds: float) -> None:
        self.folder = folder
        self.end = time.monotonic() + seconds
        self._lock = threading.Lock()
        self._began = time.monotonic()

    @property
    def is_over(self) -> bool:
        return time.monotonic() > self.end

    def tell(self, kind: str, **facts: Any) -> None:
        """One line of ``events.jsonl``."""
        line = {"second": round(time.monotonic() - self._began, 1), "kind": kind, **facts}
        with self._lock, (self.folder / "events.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


class Cycles:
    """Lateness of one motion's cycles; keeps nothing else."""

    def __init__(self) -> None:
        self.lateness: list[np.ndarray[Any, Any]] = []

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """A stream is about to start."""

    def samples(self, samples: Samples) -> None:
        self.lateness.append(samples.lateness)

    def end(self, result: StreamResult | None) -> None:
        """It is over."""


def recorder(folder: Path, seconds: float) -> None:
    """Motion after motion; the process of its own that the soak watches."""
    soak = Soak(folder, seconds)
    robot = robots.load("tx40")
    motion = plan(
        robot,
        cycle_time=robot.bus.cycle_time,
        duration=12.0,
        periods=50,
        seed=0,
        evaluations=300,
        start=np.array(robot.home),
    )
    soak.tell("planned", rows=len(motion.time))
    number = 0
    while not soak.is_over:
        order = ArmOrder(robot, "tx40", TX40, simulated=True, seed=1)
        try:
            with Catalogue() as catalogue, opened(order, catalogue, Silent(), "drive") as arm:
                while not soak.is_over:
                    number += 1
                    cycles = Cycles()
                    capture = folder / f"motion-{number}.mcap"
                    _, result = Recording(arm, order, catalogue, cycles, unconducted).record(
                        "run", "Soak", motion, capture
                    )
                    late = 1e3 * np.percentile(np.concatenate(cycles.lateness), [50, 99, 99.9, 100])
                    soak.tell(
                        "motion",
                        outcome=str(result.outcome),
                        cycles=int(result.cycles),
                        missed=int(result.missed_cycles),
                        late=int(result.late_cycles),
                        incomplete=int(result.incomplete_cycles),
                        lateness_ms=[round(float(value), 3) for value in late],
                        megabytes=round(capture.stat().st_size / 1e6, 1),
                    )
                    if str(result.outcome) != "completed":
                        break
        except UserError as error:
            soak.tell("refused", sentence=str(error))


def checks(soak: Soak) -> None:
    """A check every few minutes; the first model is accepted."""
    bus = ("--simulated", "--interface", "udp_multicast", "--channel", EMPS, "--celsius", "21")
    motion = ("--duration", "8", "--evaluations", "300")
    number, accepted = 0, False
    while not soak.is_over:
        number += 1
        out = soak.folder / f"check-{number}"
        command = [sys.executable, "-m", "daq", "check", "emps", *bus, "--out", str(out), "--json", "--quiet"]
        began = time.monotonic()
        done = subprocess.run([*command, *([] if accepted else motion)], capture_output=True, text=True)
        told: dict[str, Any] = {}
        with suppress(json.JSONDecodeError):
            told = json.loads(done.stdout)
        facts = {"code": done.returncode, "seconds": round(time.monotonic() - began, 1)}
        soak.tell(
            "check", **facts, verdict=told.get("verdict"), said=told.get("sentence") or done.stderr[-300:]
        )
        if not accepted and told.get("run"):
            words = ("baseline", "accept", str(told["run"]), "--reason", "soak", "--author", "soak")
            said = subprocess.run([sys.executable, "-m", "daq", *words], capture_output=True, text=True)
            accepted = said.returncode == 0
            soak.tell("accepted", code=said.returncode, said=(said.stdout + said.stderr)[-300:])
        _pause(soak, BETWEEN_CHECKS if accepted else 20.0)


def _pause(soak: Soak, seconds: float) -> None:
    until = min(soak.end, time.monotonic() + seconds)
    while time.monotonic() < until:
        time.sleep(0.5)


def look_on(soak: Soak, browser: Browser) -> None:
    """On the live page while a motion runs, through the other pages where none does."""
    runs = json.loads(browser.evaluate("fetch('/api/runs').then(a => a.text())"))
    listed = runs["runs"] if isinstance(runs, dict) else runs
    driven = [one for one in listed if one.get("arm", "").startswith("tx40")]
    if not driven:
        _pause(soak, 5.0)
        return
    number = max(int(one["number"]) for one in driven)
    browser.open(f"/runs/{number}/live")
    shown, since, looks = "", time.monotonic(), 0
    while not soak.is_over:
        _pause(soak, 5.0)
        looks += 1
        if looks % 12 == 0:
            soak.tell("heap", **heap(browser))
        state = browser.evaluate("document.querySelector('#live-state')?.textContent ?? ''")
        now = browser.evaluate("document.querySelector('#live-time')?.textContent ?? ''")
        if state.startswith("over"):
            break
        if now != shown:
            shown, since = now, time.monotonic()
        elif time.monotonic() - since > 60:
            soak.tell("live view stood still", run=number, state=state, shown=now)
            break
    soak.tell(
        "looked on", run=number, shown=shown, problems=len(browser.problems), first=browser.problems[:1]
    )
    browser.problems.clear()
    for path in ("/", "/runs", f"/runs/{number}"):
        browser.open(path)
    _pause(soak, 5.0)


def heap(browser: Browser) -> dict[str, float]:
    """What the page uses, after a collection."""
    browser.call("HeapProfiler.collectGarbage")
    figures = {one["name"]: one["value"] for one in browser.call("Performance.getMetrics")["metrics"]}
    return {"megabytes": round(figures["JSHeapUsedSize"] / 1e6, 2), "nodes": int(figures["Nodes"])}


def browse(soak: Soak, port: int) -> None:
    """One browser for the whole time."""
    program = chromium()
    assert program, "no Chromium here"
    with browsing(program, soak.folder / "profile", f"http://127.0.0.1:{port}") as browser:
        browser.call("Performance.enable")
        browser.open("/runs")
        while not soak.is_over:
            try:
                look_on(soak, browser)
            except (AssertionError, TimeoutError) as error:
                soak.tell("browser", said=str(error)[:300])
                browser.open("/runs")


def sample(soak: Soak, roots: dict[str, int]) -> None:
    """Memory of the parts, each minute, until the end."""
    with (soak.folder / "memory.csv").open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["second", "part", "processes", "megabytes", "cpu_seconds", "files"])
        began = time.monotonic()
        while not soak.is_over:
            for part, members in parts(roots).items():
                rows.writerow([round(time.monotonic() - began), part, *used(members)])
            file.flush()
            _pause(soak, MINUTE)


def parts(roots: dict[str, int]) -> dict[str, list[int]]:
    """Processes of each part: those under its root; of the rest the browser's, and the checks'."""
    found = {part: tree(root) for part, root in roots.items()}
    known = {os.getpid(), *(one for members in found.values() for one in members)}
    rest = [one for one in tree(os.getpid()) if one not in known]
    browsers = [one for one in rest if "chrom" in name_of(one)]
    return found | {"browser": browsers, "checks": [one for one in rest if one not in browsers]}


def name_of(pid: int) -> str:
    with suppress(OSError):
        return (Path("/proc") / str(pid) / "comm").read_text()
    return ""


def tree(root: int) -> list[int]:
    """A process and all below it."""
    children: dict[int, list[int]] = {}
    for entry in Path("/proc").iterdir():
        with suppress(OSError, ValueError):
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            children.setdefault(int(fields[1]), []).append(int(entry.name))
    found, todo = [], [root]
    while todo:
        found.append(todo.pop())
        todo += children.get(found[-1], [])
    return found


def used(members: list[int]) -> tuple[int, float, float, int]:
    """Number, proportional memory in MB, processor time in s and open files of processes."""
    memory = ticks = files = 0
    for pid in members:
        with suppress(OSError):
            place = Path("/proc") / str(pid)
            rollup = (place / "smaps_rollup").read_text()
            memory += next(int(line.split()[1]) for line in rollup.splitlines() if line.startswith("Pss:"))
            fields = (place / "stat").read_text().rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
            files += len(list((place / "fd").iterdir()))
    return len(members), round(memory * 1024 / 1e6, 1), ticks / os.sysconf("SC_CLK_TCK"), files


@contextmanager
def service(folder: Path) -> Iterator[tuple[int, int]]:
    """``armhil serve``: its port and process id."""
    command = [sys.executable, "-m", "daq", "serve", "--port", "0"]
    log = (folder / "serve.log").open("w")
    with log, subprocess.Popen(command, stderr=subprocess.PIPE, stdout=log, text=True) as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        drain = threading.Thread(target=lambda: log.write(process.stderr.read()), daemon=True)  # type: ignore[union-attr]
        drain.start()
        try:
            yield int(said.rsplit(":", 1)[1].partition("/")[0]), process.pid
        finally:
            process.terminate()
            process.wait()
            drain.join(5)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--hours", type=float, default=2.0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--page", type=Path, help="folder of a soak, finished or not")
    parser.add_argument("--recorder", nargs=2, metavar=("FOLDER", "SECONDS"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.page:
        print(page(given.page))
        return 0
    if given.recorder:
        recorder(Path(given.recorder[0]), float(given.recorder[1]))
        return 0
    folder, seconds = given.out.resolve(), 3600 * given.hours
    folder.mkdir(parents=True)
    os.environ |= {"ARMHIL_CATALOGUE": str(folder / "catalogue.db"), "ARMHIL_STATE": str(folder / "state")}
    soak = Soak(folder, seconds)
    command = [sys.executable, "-m", "benchmarks.soak", "--recorder", str(folder), str(seconds)]
    with service(folder) as (port, served), subprocess.Popen(command) as recording:
        roots = {"recorder": recording.pid, "service": served}
        watch = threading.Thread(target=sample, args=(soak, roots))
        watching = [watch, threading.Thread(target=checks, args=(soak,))]
        for thread in watching:
            thread.start()
        browse(soak, port)
        for thread in watching:
            thread.join()
        recording.wait()
    print(page(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
