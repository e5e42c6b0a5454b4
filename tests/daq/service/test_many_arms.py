"""A page of two hundred arms asks the database no more often than one of two."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import Engine, QueuePool, create_engine, event, make_url, update

from daq.catalogue import baselines, checks, overview, runs
from daq.catalogue.database import Catalogue, _engine
from daq.catalogue.schema import checks as checks_table
from daq.catalogue.values import ArmIdentity
from daq.service.app import ANSWERING
from tests.daq.service.filled import fill


@contextmanager
def counted() -> Iterator[list[str]]:
    asked: list[str] = []

    def note(connection: object, cursor: object, statement: str, *_: object) -> None:
        asked.append(statement)

    event.listen(Engine, "before_cursor_execute", note)
    try:
        yield asked
    finally:
        event.remove(Engine, "before_cursor_execute", note)


def add_arms(catalogue: Catalogue, count: int) -> None:
    for serial in range(100, 100 + count):
        identity = ArmIdentity("emps", (serial,), "0" * 64, simulated=True)
        run = runs.begin(catalogue, identity, "check")
        runs.finish(catalogue, run.id, "completed")
        checks.add(catalogue, run.id, "ok", "nothing has moved", {"state": "unchanged"})


@pytest.mark.parametrize("path", ["/", "/metrics", "/api/arms"])
def test_queries_do_not_grow_with_the_arms(client: TestClient, filled: Catalogue, path: str) -> None:
    add_arms(filled, 2)
    with counted() as few:
        client.get(path)
    add_arms(filled, 12)
    with counted() as many:
        text = client.get(path).text
    assert len(many) == len(few) <= 14, "\n".join(many)
    assert text.count("emps-sim") >= 13


@pytest.mark.parametrize("path", ["/", "/api/arms", "/arms/emps-sim", "/metrics"])
def test_details_of_checks_stay_in_the_database(client: TestClient, filled: Catalogue, path: str) -> None:
    """Tens of kilobytes a night; a scrape needs them once."""
    client.get(path)
    with counted() as asked:
        client.get(path)
    whole = [statement for statement in asked if re.search(r"(?<!\()checks\.details", statement)]
    assert asked and whole == []


@pytest.mark.parametrize("path", ["/", "/api/arms", "/arms/emps-sim", "/metrics", "/runs", "/runs/12"])
def test_no_page_reads_years_of_nights_to_find_the_newest(
    client: TestClient, filled: Catalogue, path: str
) -> None:
    """Of runs, models and checks only what an index leads to: no table is read from end to end."""
    client.get(path)
    with counted() as asked:
        client.get(path)
    plans = []
    with sqlite3.connect(str(filled.url.database)) as connection:
        for statement in asked:
            if statement.startswith("SELECT"):
                values = (1,) * statement.count("?")
                rows = connection.execute(f"EXPLAIN QUERY PLAN {statement}", values).fetchall()
                plans += [row[3] for row in rows]
    assert plans
    scans = [plan for plan in plans if re.fullmatch(r"SCAN (runs|checks|models|parameters)", plan)]
    assert scans == (["SCAN runs"] if path == "/runs" else [])  # newest first, and ends at its limit


def test_metrics_are_of_the_newest_check_though_they_are_remembered(
    client: TestClient, filled: Catalogue
) -> None:
    def shares() -> list[str]:
        found = client.get("/metrics").text
        return re.findall(r'armhil_torque_change_share\{arm="emps-sim",joint="1"\} (\S+)', found)

    before = shares()
    compared = {"torque_change": [3.0], "torque_rms": [12.0], "between_runs": {"p_value": 0.25}}
    run = runs.begin(filled, ArmIdentity("emps", (7,), "0" * 64, simulated=True), "check")
    checks.add(filled, run.id, "failed", "moved", {"comparison": compared})
    assert before != shares() == ["0.25"]
    assert 'armhil_p_value{arm="emps-sim"} 0.25' in client.get("/metrics").text
    for odd in (
        {},
        [],
        None,
        {"comparison": []},
        {"comparison": {"torque_change": ["x"], "torque_rms": [1]}},
    ):
        number = checks.add(filled, run.id, "failed", "moved", {}).id
        with filled.writing() as connection:
            connection.execute(update(checks_table).where(checks_table.c.id == number).values(details=odd))
        for path in (
            "/metrics",
            "/",
            f"/runs/{run.id}",
            "/arms/emps-sim",
            f"/api/runs/{run.id}",
            "/api/arms",
        ):
            assert client.get(path).status_code == 200, (odd, path)
        assert client.get("/api/arms/emps-sim").status_code == 200
        assert shares() == []


def test_each_arm_has_what_is_its_own(filled: Catalogue, tmp_path: Path) -> None:
    add_arms(filled, 3)
    found = {one.arm.serials: one for one in overview.every(filled)}
    assert len(found) == 4
    first = found[(7,)]
    assert first.check is not None and first.check.verdict == "failed" and first.baseline is not None
    assert first.baseline == baselines.current(filled, first.arm.id) and first.run is not None
    assert first.run.id == 12 and first.unfinished is None
    other = found[(101,)]
    assert other.baseline is None and other.check is not None and other.check.verdict == "ok"
    assert other.run is not None and other.check.run_id == other.run.id == 14
    baselines.roll_back(filled, first.arm.id, "Ada", "wrong")
    late = runs.begin(filled, ArmIdentity("emps", (101,), "0" * 64, simulated=True), "check")
    runs.finish(filled, late.id, "aborted")
    (first,), (other,) = (overview.every(filled, one.arm.label) for one in (first, other))
    assert first.baseline is None
    assert other.unfinished is not None and other.unfinished.id == late.id == 16
    assert overview.every(filled, "nobody") == ()


def test_nights_that_found_nothing_are_counted_by_the_database(tmp_path: Path) -> None:
    with Catalogue() as catalogue:
        fill(catalogue, tmp_path)
        arm = overview.every(catalogue)[0]
        assert arm.baseline is not None
        assert checks.clean_models(catalogue, arm.baseline) == set(range(1, 12))
        for details, model, counts in (
            ({"state": "unchanged", "grown": []}, 3, True),
            ({"state": "unchanged", "grown": [2]}, 12, False),
            ({"state": "unchanged", "grown": None}, 5, True),
            ({}, 12, False),
        ):
            number = arm.baseline.id
            checks.add(catalogue, 12, "warning", "x", details, model_id=model, baseline_id=number)
            assert (model in checks.clean_models(catalogue, arm.baseline)) == counts


@pytest.mark.parametrize("path", ["/", "/metrics", "/api/arms", "/arms/emps-sim", "/runs", "/runs/12"])
def test_an_answer_takes_one_connection_and_there_is_one_for_each_thread(
    client: TestClient, filled: Catalogue, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    held: list[int] = []
    pool = create_engine(filled.url, poolclass=QueuePool, pool_size=4)
    event.listen(pool, "checkout", lambda *_: held.append(pool.pool.checkedout()))  # type: ignore[attr-defined]
    monkeypatch.setattr(filled, "_engine", pool)
    assert client.get(path).status_code == 200
    assert held and max(held) == 1
    pool.dispose()
    served = _engine(make_url("postgresql+psycopg://armhil@localhost/none")).pool
    assert isinstance(served, QueuePool) and served.size() + served._max_overflow >= ANSWERING


@pytest.mark.parametrize("path", ["/", "/metrics", "/api/arms", "/runs/12"])
def test_a_database_whose_connections_are_all_taken_is_for_later(
    client: TestClient, filled: Catalogue, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    """Where others keep them for longer than is waited for: no mistake, and whoever asks may ask again."""
    url = filled.url
    pool = create_engine(url, poolclass=QueuePool, pool_size=1, max_overflow=0, pool_timeout=0.05)
    monkeypatch.setattr(filled, "_engine", pool)
    with filled.reading():
        answer = client.get(path)
    assert (answer.status_code, answer.headers["Retry-After"]) == (503, "10")
    assert "all connections to it are taken" in answer.json()["detail"]
    assert client.get(path).status_code == 200
    pool.dispose()
