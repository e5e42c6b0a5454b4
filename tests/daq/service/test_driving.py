"""A check that is started over HTTP, from the token to the verdict; one that is stopped while it moves."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from daq.catalogue import arms, checks, leases, runs
from daq.catalogue.database import Catalogue
from daq.service.app import create_app
from daq.service.settings import Service
from drivers import Channel
from robots import Robot
from tests.daq.service.fleets import write_fleet

READ, DRIVE = "read-token-of-the-test", "drive-token-of-the-test"
PATIENCE = 240.0


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def until(condition: Callable[[], Any]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "it never came to that"
        time.sleep(0.05)


@pytest.mark.slow
def test_a_check_from_the_token_to_the_verdict_and_one_that_is_stopped(
    emps: Robot, channel: Channel, tmp_path: Path, no_leftovers: None
) -> None:
    write_fleet(tmp_path / "fleet.toml", emps, channel)
    service = Service(read_token=READ, drive_token=DRIVE, fleet=tmp_path / "fleet.toml")
    with (
        Catalogue() as catalogue,
        TestClient(create_app(service, catalogue, tmp_path / "http"), base_url="http://localhost") as client,
    ):

        def jobs() -> list[dict[str, Any]]:
            return list(client.get("/api/jobs", headers=bearer(READ)).json())

        start = "/api/fleet/1/check"
        for headers, code in (({}, 401), (bearer("x" * 20), 401), (bearer(READ), 403)):
            assert client.post(start, headers=headers).status_code == code
        assert client.post("/api/fleet/2/check", headers=bearer(DRIVE)).status_code == 409
        assert jobs() == [] and runs.every(catalogue) == ()

        begun = client.post(start, headers=bearer(DRIVE))
        assert begun.status_code == 202 and begun.json()["robot"] == "emps"
        again = client.post(start, headers=bearer(DRIVE))
        assert again.status_code == 409 and "being checked already" in again.json()["detail"]
        until(lambda: jobs()[0]["exit_code"] is not None)
        assert [job["exit_code"] for job in jobs()] == [3]  # no baseline yet
        (run,) = runs.every(catalogue)
        (arm,) = arms.every(catalogue)
        assert run.outcome == "completed" and checks.of_run(catalogue, run.id)[0].verdict == "unknown"
        assert leases.holder_of(catalogue, arm.id) is None

        job = client.post(start, headers=bearer(DRIVE)).json()["job"]
        until(lambda: runs.every(catalogue)[0].state == "running")
        stop = f"/api/jobs/{job}/stop"
        assert client.post(stop, headers=bearer(READ)).status_code == 403
        assert client.post(stop, headers=bearer(DRIVE)).status_code == 202
        until(lambda: jobs()[0]["exit_code"] is not None)
        stopped = runs.every(catalogue)[0]
        assert (stopped.outcome, checks.of_run(catalogue, stopped.id)) == ("stopped", ())
        assert jobs()[0]["exit_code"] == 130 and leases.holder_of(catalogue, arm.id) is None
        assert client.post(stop, headers=bearer(DRIVE)).status_code == 409


@pytest.mark.parametrize("drive_token", [None, DRIVE])
def test_nothing_moves_unless_it_is_turned_on_and_asked_for_with_the_right_token(
    drive_token: str | None, tmp_path: Path
) -> None:
    with Catalogue() as catalogue:
        service = Service(drive_token=drive_token, fleet=tmp_path / "fleet.toml")
        client = TestClient(create_app(service, catalogue, tmp_path), base_url="http://localhost")
        (tmp_path / "fleet.toml").write_text('format = 1\n[[arm]]\nrobot = "emps"\n')
        for headers in (
            {},
            bearer("wrong-token-of-the-test"),
            *([bearer(DRIVE)] if drive_token is None else []),
        ):
            assert client.post("/api/fleet/1/check", headers=headers).status_code == 403
        assert client.get("/api/jobs").json() == []
