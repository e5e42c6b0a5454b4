"""The night of 200 arms with 300 nights behind them, on PostgreSQL, with what goes wrong in some night.

    PYTHONPATH=. python benchmarks/many_arms_night.py --arms 200 --nights 300 --buses 4

Starts a server of its own (Debian's package postgresql), gives every arm a first run, a baseline and copies
of it with noise, and calls ``armhil check --all`` as a timer does: through joblib's processes, then through
dask. One arm is broken, one description is wrong, one process is killed. Beside that ``armhil prune
--older-than 0`` deletes recordings and a service answers. Most arms move in virtual time, as in
tests/daq/check/offline_arms.py; the last few are streamed over buses.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from live_clients import processor_seconds, service
from sqlalchemy import text

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import robots
from daq.catalogue import baselines
from daq.catalogue.database import Catalogue
from daq.check import analysis
from daq.check import check as check_module
from daq.check.analysis import AnalysisOrder, analyse
from daq.check.recorded import Recorded
from daq.check.request import CheckRequest
from daq.cli import entry
from daq.text.progress import Steps
from ident import Fitted
from robots.errors import UserError
from tests.daq.catalogue.postgres import server
from tests.daq.check.offline_arms import record_offline, write_motion

BROKEN, WRONG, DIES = 5, 6, 7
"""Places in the fleet, from 1: whose gain falls by a fifth, whose file is none, whose process is killed."""
MARK = "ARMHIL_NIGHT_DEATH"
VIRTUAL = "239.74.1."
_NOISE = "sqrt(-2 * ln(1 - random())) * cos(2 * pi() * random())"  # Box and Muller
_FILL = (
    """UPDATE runs SET started = started - :nights * interval '1 day',
                       finished = finished - :nights * interval '1 day'""",
    "UPDATE models SET created = created - :nights * interval '1 day'",
    "UPDATE checks SET created = created - :nights * interval '1 day'",
    "UPDATE baselines SET accepted = accepted - :nights * interval '1 day'",
    """INSERT INTO runs (arm_id, kind, stage, description_sha256, started, finished, who, process, trajectory,
                          state, outcome, reason, facts, note)
       SELECT arm_id, kind, stage, description_sha256, started + n * interval '1 day',
              finished + n * interval '1 day', who, '', trajectory, state, outcome, '', facts, ''
       FROM runs, generate_series(1, :nights - 1) n WHERE id <= :first ORDER BY n, arm_id""",
    """INSERT INTO models (arm_id, run_id, created, who, method, verdict, recommendation, gates, rows,
                            relative_error_percent, torque_rms, effects, found, covariance_kind, covariance,
                            settings, sources, description_sha256, armhil)
       SELECT r.arm_id, r.id, r.started, m.who, m.method, m.verdict, m.recommendation, m.gates, m.rows,
              m.relative_error_percent, m.torque_rms, m.effects, m.found, m.covariance_kind, m.covariance,
              m.settings, m.sources, m.description_sha256, m.armhil
       FROM runs r JOIN models m ON m.arm_id = r.arm_id AND m.run_id <= :first
       WHERE r.id > :first ORDER BY r.id""",
    f"""INSERT INTO parameters (model_id, place, name, value, sigma, unit, expression)
       SELECT m.id, p.place, p.name, p.value + p.sigma * {_NOISE}, p.sigma, p.unit, p.expression
       FROM models m JOIN models f ON f.arm_id = m.arm_id AND f.run_id <= :first
       JOIN parameters p ON p.model_id = f.id WHERE m.run_id > :first ORDER BY m.id, p.place""",
    """INSERT INTO checks (arm_id, run_id, model_id, baseline_id, created, verdict, sentence, details)
       SELECT m.arm_id, m.run_id, m.id, b.id, m.created, 'ok', 'nothing has moved',
              (c.details::jsonb || '{"state": "unchanged"}')::json
       FROM models m JOIN baselines b ON b.arm_id = m.arm_id
       JOIN checks c ON c.arm_id = m.arm_id AND c.run_id <= :first
       WHERE m.run_id > :first ORDER BY m.id""",
    "ANALYZE",
)


def record(request: CheckRequest, steps: Steps, watcher: Any, conducting: Any) -> Recorded:
    """On its bus where it has one, else in virtual time."""
    offline = request.arm.channel.name.startswith(VIRTUAL)
    return (record_offline if offline else _on_its_bus)(request, steps, watcher, conducting)


_on_its_bus = check_module.record_check


def deadly(order: AnalysisOrder) -> Fitted | Exception:
    """In place of :func:`daq.check.analysis.tried`: one process is killed once, as by a lack of memory."""
    place, mark = f"{DIES:02d}-", Path(os.environ[MARK])
    if order.capture.parent.name.startswith(place) and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    try:
        return analyse(order)
    except (UserError, OSError) as error:
        return error


def write_fleet(folder: Path, arms: int, buses: int, motion: Path, *, healthy: bool) -> Path:
    """All arms; in the nights that count one has lost gain, and one has a description that is none."""
    (folder / "gain.toml").write_text("format = 1\n[[drive_gain_error]]\ndrive = 1\nchange = -0.2\n")
    (folder / "robot.toml").write_text("format = 1\nname = 7\n")
    lines = ["format = 1"]
    for place in range(1, arms + 1):
        name = str(folder / "robot.toml") if place == WRONG and not healthy else "emps"
        channel = f"239.74.2.{place}:19999" if place > arms - buses else f"{VIRTUAL}{place}:19999"
        lines += ["[[arm]]", f'robot = "{name}"', 'interface = "udp_multicast"', f'channel = "{channel}"']
        lines += ["simulated = true", f"seed = {place}", f'trajectory = "{motion}"']
        lines += [f'scenario = "{folder / "gain.toml"}"'] if place == BROKEN and not healthy else []
    file = folder / ("healthy.toml" if healthy else "fleet.toml")
    file.write_text("\n".join(lines) + "\n")
    return file


def check_all(fleet: Path, out: Path, backend: str, buses: int) -> dict[str, Any]:
    """``armhil check --all --json`` in this process: what it prints, and its seconds."""
    out_text, sys.argv = StringIO(), ["armhil", "check", "--all", "--fleet", str(fleet), "--json"]
    sys.argv += ["--backend", backend, "--jobs", "2", "--at-once", str(max(1, buses)), "--out", str(out)]
    begun = time.monotonic()
    try:
        with redirect_stdout(out_text), redirect_stderr(sys.stderr):
            entry.main()
    except SystemExit as ended:
        code = ended.code
    return {**json.loads(out_text.getvalue()), "seconds": time.monotonic() - begun, "code": code}


class Beside(threading.Thread):
    """Asks the service for its pages, and prunes again and again, until it is told to stop."""

    def __init__(self, port: int, pause: float) -> None:
        super().__init__(daemon=True)
        self.over = threading.Event()
        self._pause = pause
        self.seconds: dict[str, list[float]] = {"/": [], "/metrics": [], "/arms/emps-sim": []}
        self.deleted, self.prunes = 0, 0
        self._port = port

    def run(self) -> None:
        """Bother."""
        pruning: subprocess.Popen[str] | None = None
        command = [sys.executable, "-m", "daq", "prune", "--older-than", "0", "--yes", "--json"]
        while not self.over.wait(self._pause):
            if pruning is None:
                pruning = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
            elif pruning.poll() is not None:
                self._count(pruning)
                pruning = None
            for path, seconds in self.seconds.items():
                begun = time.monotonic()
                with urllib.request.urlopen(f"http://127.0.0.1:{self._port}{path}", timeout=60) as answer:
                    answer.read()
                seconds.append(time.monotonic() - begun)
        if pruning is not None:
            self._count(pruning)

    def _count(self, pruning: subprocess.Popen[str]) -> None:
        said = pruning.communicate()[0]
        assert pruning.returncode == 0, said
        self.deleted += len(json.loads(said)["deleted"])
        self.prunes += 1


def night(
    fleet: Path, folder: Path, backend: str, buses: int, served: tuple[int, int], pause: float
) -> dict[str, Any]:
    """One night with everything beside it: what became of the arms, and what it took."""
    os.environ[MARK] = str(folder / f"death-{backend}")
    port, pid = served
    beside = Beside(port, pause)
    used = processor_seconds(pid)
    beside.start()
    done = check_all(fleet, folder / backend, backend, buses)
    beside.over.set()
    beside.join()
    used = processor_seconds(pid) - used
    arms = done["arms"]
    verdicts = [arm["verdict"] for arm in arms]
    odd = {
        place: arm.get("error", arm.get("sentence"))
        for place, arm in enumerate(arms, 1)
        if arm["verdict"] != "ok"
    }
    return {
        "backend": backend,
        "seconds": done["seconds"],
        "exit_code": done["code"],
        "verdicts": {verdict: verdicts.count(verdict) for verdict in sorted(set(verdicts))},
        "not_fine": odd,
        "a_process_died": Path(os.environ[MARK]).exists(),
        "its_arm": verdicts[DIES - 1],
        "prunes": beside.prunes,
        "pruned": beside.deleted,
        "pages": {
            path: [statistics.median(took), max(took), len(took)] for path, took in beside.seconds.items()
        },
        "processor_seconds_an_answer": used / max(1, sum(map(len, beside.seconds.values()))),
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "memory_of_a_worker_mb": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024,
        "load": os.getloadavg()[0],
    }


def fill(catalogue: Catalogue, begun: int, nights: int) -> None:
    """So many nights of each of the runs that were begun, by the server itself."""
    values = {"first": begun, "nights": nights}
    for statement in _FILL:
        with catalogue.writing() as connection:
            wanted = {name: value for name, value in values.items() if f":{name}" in statement}
            connection.execute(text(statement), wanted)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arms", type=int, default=200)
    parser.add_argument("--nights", type=int, default=300)
    parser.add_argument("--buses", type=int, default=4, help="arms that are streamed over a bus")
    parser.add_argument("--pause", type=float, default=1.0, help="s between two looks at the pages")
    parser.add_argument("--backends", nargs="+", default=["loky", "dask"])
    given = parser.parse_args()
    check_module.record_check, analysis.tried = record, deadly
    with tempfile.TemporaryDirectory(prefix="armhil-night-") as name, server() as url:
        folder = Path(name)
        os.environ |= {
            "ARMHIL_CATALOGUE": url.format("postgres"),
            "ARMHIL_FLEET": str(folder / "none.toml"),
            MARK: name,  # there already: nobody dies in the first night
        }
        motion = write_motion(robots.load("emps"), folder, 4.0)
        fleet = write_fleet(folder, given.arms, given.buses, motion, healthy=True)
        first = check_all(fleet, folder / "first", "loky", given.buses)
        print(f"first night: {first['seconds']:.0f} s", flush=True)
        with Catalogue() as catalogue:
            for arm in first["arms"]:
                if "model" in arm:  # a stream may fail on a machine that others use
                    baselines.accept(catalogue, arm["model"], "Ada", "first night", None)
            with catalogue.reading() as connection:
                begun = connection.execute(text("SELECT max(id) FROM runs")).scalar_one()
            fill(catalogue, begun, given.nights)
            with catalogue.reading() as connection:
                count = connection.execute(text("SELECT count(*) FROM checks")).scalar_one()
        print(f"{count} checks in the catalogue", flush=True)
        fleet = write_fleet(folder, given.arms, given.buses, motion, healthy=False)
        with service(os.environ["ARMHIL_CATALOGUE"]) as served:
            for backend in given.backends:
                done = night(fleet, folder, backend, given.buses, served, given.pause)
                print(json.dumps(done, indent=1), flush=True)


if __name__ == "__main__":
    main()
