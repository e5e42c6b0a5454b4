"""How long pages and metrics take with many arms and years of nights in the catalogue, on PostgreSQL.

    PYTHONPATH=. python benchmarks/many_arms.py --arms 200 --nights 300

Starts a server of its own (Debian's package postgresql), fills it with copies of one night by its own SQL,
and asks the service for each page in turn: seconds on the clock and of the processor, and those with one arm.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sqlalchemy import text

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from fastapi.testclient import TestClient

from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.settings import Service
from tests.daq.catalogue.postgres import server
from tests.daq.service.filled import fill

PARAMETERS = 61
"""Of a six-axis arm."""
CHARTS = 45
_FIGURES = ("prior_sigma", "sigma", "low", "high", "forgiven")
_SLOPES = ("prior_per_kelvin", "prior_per_kelvin_sigma", "per_kelvin", "per_kelvin_sigma")
_FILL = (
    """INSERT INTO arms (label, name, serials, simulated, description_sha256, first_seen)
       SELECT 'copy-' || k, name, '[' || 1000 + k || ']', simulated, description_sha256, first_seen
       FROM arms, generate_series(2, :arms) k WHERE arms.id = 1""",
    """INSERT INTO runs (arm_id, kind, stage, description_sha256, started, finished, who, process, trajectory,
                          state, outcome, reason, facts, note)
       SELECT a.id, 'check', '', r.description_sha256, r.started + n * interval '1 day',
              r.finished + n * interval '1 day', r.who, '', r.trajectory, 'finished', 'completed', '',
              r.facts, ''
       FROM runs r, arms a, generate_series(1, :nights) n WHERE r.id = 12 ORDER BY n, a.id""",
    """INSERT INTO models (arm_id, run_id, created, who, method, verdict, recommendation, gates, rows,
                            relative_error_percent, torque_rms, effects, found, covariance_kind, settings,
                            sources, description_sha256, armhil)
       SELECT r.arm_id, r.id, r.started, m.who, m.method, m.verdict, m.recommendation, m.gates, m.rows,
              m.relative_error_percent, m.torque_rms, m.effects, m.found, m.covariance_kind, m.settings,
              m.sources, m.description_sha256, m.armhil
       FROM runs r, models m WHERE m.id = 12 AND r.id > 12 ORDER BY r.id""",
    """INSERT INTO parameters (model_id, place, name, value, sigma, unit, expression)
       SELECT m.id, p, 'P' || p, 10 + p + 0.01 * random(), 0.01, 'N·m', 'P' || p
       FROM models m, generate_series(1, :parameters) p WHERE m.id > 12 ORDER BY m.id, p""",
    """INSERT INTO baselines (arm_id, model_id, run_id, state, description_sha256, accepted)
       SELECT arm_id, min(id), min(run_id), 'accepted', min(description_sha256), min(created)
       FROM models WHERE id > 12 GROUP BY arm_id""",
    """INSERT INTO baseline_events (baseline_id, state, author, reason, at)
       SELECT id, 'accepted', 'Ada', 'first run', accepted FROM baselines WHERE id > 1""",
    """INSERT INTO checks (arm_id, run_id, model_id, baseline_id, created, verdict, sentence, details)
       SELECT m.arm_id, m.run_id, m.id, b.id, m.created, 'ok', 'nothing has moved', CAST(:details AS json)
       FROM models m JOIN baselines b ON b.arm_id = m.arm_id WHERE m.id > 12 AND b.id > 1 ORDER BY m.id""",
    "ANALYZE",
)


def details_of_a_night(nights: int) -> str:
    """As a check keeps them: a comparison with its charts and the course of one of them."""
    usual = {
        "chart": "Coulomb friction of joint 1",
        "unit": "%",
        **dict.fromkeys((*_FIGURES, *_SLOPES), 0.123456789),
    }
    rng = np.random.default_rng(0)
    course = {
        "chart": usual["chart"],
        "unit": "%",
        "labels": [f"run {k} (2026-11-22)" for k in range(nights)],
        "day": list(range(nights)),
        "amount": rng.normal(size=nights).tolist(),
        "clean": [True] * nights,
        "low": -1.0,
        "high": 1.0,
    }
    compared = {
        "state": "unchanged",
        "stage": "watching",
        "torque_change": [0.1] * 6,
        "torque_rms": [10.0] * 6,
        "between_runs": {"p_value": 0.5},
        "usual": [usual] * CHARTS,
        "course": course,
        "parameters": [],
        "changes": [],
    }
    return json.dumps({"state": "unchanged", "grown": [], "celsius": [21.0], "comparison": compared})


def fill_years(catalogue: Catalogue, arms: int, nights: int) -> None:
    """Copies of one night of one arm."""
    values = {
        "arms": arms,
        "nights": nights,
        "parameters": PARAMETERS,
        "details": details_of_a_night(nights),
    }
    for statement in _FILL:
        begun = time.monotonic()
        with catalogue.writing() as connection:
            wanted = {name: value for name, value in values.items() if f":{name}" in statement}
            connection.execute(text(statement), wanted)
        words = " ".join(statement.split()[:3])
        print(f"{words}: {time.monotonic() - begun:.1f} s", file=sys.stderr, flush=True)


def database_seconds() -> float:
    """Processor time of the database's processes that answer this user, s, in steps of 10 ms."""
    ticks = 0
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if "postgres: armhil" in (process / "cmdline").read_text():
                spent = (process / "stat").read_text().rsplit(")", 1)[1].split()
                ticks += int(spent[11]) + int(spent[12])
        except OSError:  # it has ended meanwhile
            continue
    return ticks / os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Timed:
    """Answers to one path: seconds on the clock (median, least, most), of the processor (here, database)."""

    path: str
    median: float
    least: float
    most: float
    here: float
    database: float
    size: int


def timed(client: TestClient, paths: Sequence[str], times: int) -> Iterator[Timed]:
    """The first answer of each path warms up and does not count."""
    for path in paths:
        client.get(path)
        taken = []
        here, there = time.process_time(), database_seconds()
        for _ in range(times):
            begun = time.perf_counter()
            answer = client.get(path)
            taken.append(time.perf_counter() - begun)
            assert answer.status_code == 200, (path, answer.text[:200])
        here, there = time.process_time() - here, database_seconds() - there
        middle = float(np.median(taken))
        yield Timed(path, middle, min(taken), max(taken), here / times, there / times, len(answer.content))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arms", type=int, default=200)
    parser.add_argument("--nights", type=int, default=300)
    parser.add_argument("--times", type=int, default=20)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="armhil-many-") as name, server() as url:
        folder = Path(name)
        os.environ["ARMHIL_CATALOGUE"] = url.format("postgres")
        with Catalogue() as catalogue:
            fill(catalogue, folder)
            app = create_app(Service(), catalogue, folder)
            client = TestClient(app, base_url="http://localhost")
            paths = ["/", "/metrics", "/runs", "/api/arms", "/arms/emps-sim", "/api/runs"]
            few = {one.path: one.median for one in timed(client, paths, given.times)}
            fill_years(catalogue, given.arms, given.nights)
            paths += ["/arms/copy-2", f"/runs/{given.arms * given.nights // 2}"]
            for one in timed(client, paths, given.times):
                clock = f"{one.median:.3f} s ({one.least:.3f} to {one.most:.3f})"
                spent = f"processor {one.here:.3f} s here, {one.database:.3f} s database"
                before = f", {few[one.path]:.3f} s with one arm" if one.path in few else ""
                print(f"{one.path}: {clock}; {spent}; {one.size / 1000:.0f} kB{before}", flush=True)


if __name__ == "__main__":
    main()
