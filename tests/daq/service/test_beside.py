"""Two services and a prune on one catalogue: every page answers, and only what may go is gone."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from daq.catalogue import baselines, runs
from daq.catalogue.database import Catalogue
from daq.files.checksum import file_sha256
from daq.keeping.prune import plan_prune, prune
from daq.recording.who import now, this_process
from daq.service.app import create_app
from daq.service.settings import Service

PAGES = ("/", "/runs", "/metrics", "/arms/emps-sim", "/runs/12", "/api/arms", "/api/runs/3")


@pytest.fixture
def two(filled: Catalogue, tmp_path: Path) -> Iterator[tuple[TestClient, TestClient]]:
    """Each with a catalogue object of its own, as two processes have."""
    with Catalogue() as other:
        first, second = (
            TestClient(create_app(Service(), one, tmp_path), base_url="http://localhost")
            for one in (filled, other)
        )
        for client in (first, second):
            # FastAPI makes its parsers at the first request, and silences warnings of all threads for it: two
            # that do so at once undo each other's silence. A page that is none meets every route.
            assert client.get("/none").status_code == 404
        yield first, second


def recordings(catalogue: Catalogue, folder: Path) -> dict[int, Path]:
    """A file for each run, known by its checksum."""
    found = {}
    for run in runs.every(catalogue):
        file = folder / f"{run.id}.mcap"
        file.write_bytes(f"recording {run.id}".encode() * 1000)
        runs.finish(catalogue, run.id, "completed", capture=str(file), capture_sha256=file_sha256(file))
        found[run.id] = file
    return found


def test_two_services_answer_while_recordings_go_and_a_baseline_is_accepted(
    filled: Catalogue, two: tuple[TestClient, TestClient], tmp_path: Path
) -> None:
    files = recordings(filled, tmp_path)
    planned = plan_prune(filled, now() + timedelta(days=1))
    assert {entry.run.id for entry in planned.prunable} == set(files) - {1}

    def look(client: TestClient) -> list[tuple[str, int]]:
        return [(page, client.get(page).status_code) for _ in range(3) for page in PAGES]

    with ThreadPoolExecutor(5) as pool:
        looks = [pool.submit(look, client) for client in (*two, *two)]
        accepted = pool.submit(baselines.accept, filled, 5, "Ada", "beside a prune")
        done = prune(filled, planned)
        answers = [answer for one in looks for answer in one.result()]
    assert {code for _, code in answers} == {200}, [answer for answer in answers if answer[1] != 200]
    assert accepted.result().model_id == 5
    deleted = {entry.run.id for entry in done.prunable}
    assert deleted | {kept.run.id for kept in done.kept} == set(files) - {1}
    # Whoever was first had it: the recording of the new baseline went before it was one, or stays.
    assert deleted >= set(files) - {1, 5}
    assert {number for number, file in files.items() if not file.exists()} == deleted
    assert {run.id for run in runs.every(filled) if run.capture is None} == deleted
    pages = [client.get("/api/runs").json() for client in two]
    assert pages[0] == pages[1] and len(pages[0]) == len(files)


def test_a_baseline_accepted_after_the_plan_keeps_its_recording(filled: Catalogue, tmp_path: Path) -> None:
    files = recordings(filled, tmp_path)
    planned = plan_prune(filled, now() + timedelta(days=1))
    baselines.accept(filled, 5, "Ada", "in between")
    done = prune(filled, planned)
    assert files[5].exists() and files[1].exists()
    assert [(kept.run.id, kept.reason) for kept in done.kept] == [(5, "a baseline rests on it")]


@pytest.mark.parametrize("lives", [True, False])
def test_a_recording_that_waits_for_its_verdict_is_kept(
    filled: Catalogue, tmp_path: Path, lives: bool
) -> None:
    """In a fleet, hours may lie between the two; a process that is gone will judge nothing any more."""
    files = recordings(filled, tmp_path)
    process = this_process() if lives else f"{this_process().split(':')[0]}:999999999:0"
    with filled.writing() as connection:
        connection.exec_driver_sql("UPDATE runs SET process = ? WHERE id = 7", (process,))
    planned = plan_prune(filled, now() + timedelta(days=1))
    kept = {one.run.id: one.reason for one in planned.kept}
    assert kept.get(7) == ("it waits for its verdict" if lives else None)
    prune(filled, planned)
    assert files[7].exists() == lives and not files[6].exists()


def test_two_services_settle_an_abandoned_run_once(
    filled: Catalogue, two: tuple[TestClient, TestClient]
) -> None:
    gone = runs.every(filled, limit=1)[0]
    with filled.writing() as connection:
        connection.exec_driver_sql(
            "UPDATE runs SET state = 'running', outcome = '', process = ? WHERE id = ?",
            (f"{this_process().split(':')[0]}:999999999:0", gone.id),
        )
    with ThreadPoolExecutor(4) as pool:
        codes = list(pool.map(lambda client: client.get("/runs").status_code, (*two, *two)))
    assert codes == [200] * 4
    settled = runs.get(filled, gone.id)
    assert settled.state == "abandoned" and settled.reason.startswith("the process that made this run ended")
