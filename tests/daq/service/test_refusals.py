"""Who gets in, what is refused, and what may move."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from daq.catalogue.database import Catalogue
from daq.service.guard import MOST_GUESSES, Guesses
from daq.service.settings import Service, ServiceError, read_service
from tests.daq.service.serving import running

READ, DRIVE = "read-token-of-the-test", "drive-token-of-the-test"
Clients = Callable[[Service], TestClient]


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


@pytest.mark.parametrize(
    "path", ["/", "/runs", "/api/arms", "/metrics", "/runs/1", "/openapi.json", "/nothing"]
)
def test_nothing_is_shown_without_the_token(client_of: Clients, path: str) -> None:
    client = client_of(Service(read_token=READ))
    assert client.get(path).status_code == 401
    for wrong in ("", "x", READ[:-1], READ + "x", "é"):
        assert client.get(path, headers={"Authorization": f"Bearer {wrong}".encode()}).status_code == 401
    assert client.get(path, headers={"Authorization": f"Basic {READ}"}).status_code == 401
    assert client.get(path, headers=bearer(READ)).status_code in (200, 404)
    people = client.get(path, headers={"Accept": "text/html"}, follow_redirects=False)
    assert people.status_code == 303 and people.headers["location"].startswith("/login?after=/")


def test_signing_in(client_of: Clients) -> None:
    client = client_of(Service(read_token=READ))
    assert client.post("/login", data={"token": "wrong", "after": "/"}).status_code == 401
    answer = client.post("/login", data={"token": READ, "after": "/runs"}, follow_redirects=False)
    assert answer.status_code == 303 and answer.headers["location"] == "/runs"
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie and "samesite=strict" in cookie
    assert client.get("/runs").status_code == 200


@pytest.mark.parametrize(
    "after", ["//evil.example", "https://evil.example", "/\\evil.example", "javascript:x"]
)
def test_nobody_is_sent_elsewhere(client_of: Clients, after: str) -> None:
    client = client_of(Service(read_token=READ))
    answer = client.post("/login", data={"token": READ, "after": after}, follow_redirects=False)
    assert answer.headers["location"] == "/"


@pytest.mark.parametrize(
    "path",
    [
        "/static/../service.css",
        "/static/..%2f..%2f..%2fpyproject.toml",
        "/static/%2e%2e/%2e%2e/pyproject.toml",
        "/static//etc/passwd",
        "/api/runs/..%2f1/report",
        "/api/runs/1%00/report",
        "/arms/..%2f..%2fetc",
        "/runs/%2e%2e",
    ],
)
def test_names_that_climb_lead_nowhere(client: TestClient, path: str) -> None:
    answer = client.get(path)
    assert answer.status_code in (404, 422)
    assert "root:" not in answer.text and "[project]" not in answer.text


def test_large_bodies_are_refused_before_they_are_read(client: TestClient) -> None:
    for path in ("/login", "/api/fleet/1/check", "/api/arms"):
        answer = client.request("POST", path, headers={"Content-Length": "1000000000"}, content=b"")
        assert answer.status_code == 413
    chunks = (b"x" * 1000 for _ in range(1000))
    assert client.post("/login", content=chunks).status_code == 411


def test_a_body_of_a_gigabyte_over_a_real_connection(filled: Catalogue, tmp_path: Path) -> None:
    with (
        running(Service(), filled, tmp_path) as port,
        socket.create_connection(("127.0.0.1", port), 10) as sent,
    ):
        sent.sendall(b"POST /login HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1073741824\r\n\r\n")
        assert b" 413 " in sent.recv(200)


def test_foreign_names_are_refused(client: TestClient) -> None:
    assert client.get("/", headers={"Host": "evil.example"}).status_code == 421
    for host in ("localhost", "127.0.0.1:8090", "[::1]:8090"):
        assert client.get("/", headers={"Host": host}).status_code == 200


def test_driving_is_off_unless_it_is_turned_on(client: TestClient) -> None:
    for headers in ({}, bearer(READ), bearer(DRIVE)):
        assert client.post("/api/fleet/1/check", headers=headers).status_code == 403
        assert client.post("/api/jobs/1/stop", headers=headers).status_code == 403
    assert "Move the arm" not in client.get("/").text


def test_reading_is_not_driving(client_of: Clients, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ARMHIL_FLEET", str(tmp_path / "fleet.toml"))
    client = client_of(Service(read_token=READ, drive_token=DRIVE))
    assert client.post("/api/fleet/1/check").status_code == 401
    assert client.post("/api/fleet/1/check", headers=bearer(READ)).status_code == 403
    client.cookies.set("armhil_read", DRIVE)
    assert client.post("/api/fleet/1/check").status_code == 403  # a cookie is sent by any page
    client.cookies.clear()
    answer = client.post("/api/fleet/1/check", headers=bearer(DRIVE))
    assert answer.status_code == 409 and "there is no fleet" in answer.json()["detail"]


def test_other_sites_cannot_drive(client_of: Clients) -> None:
    client = client_of(Service(drive_token=DRIVE))
    for foreign in ({"Origin": "https://evil.example"}, {"Sec-Fetch-Site": "cross-site"}, {"Origin": "null"}):
        assert client.post("/api/fleet/1/check", headers={**bearer(DRIVE), **foreign}).status_code == 403
    own = {"Origin": "http://localhost", "Sec-Fetch-Site": "same-origin"}
    assert client.post("/api/jobs/1/stop", headers={**bearer(DRIVE), **own}).status_code == 409


def test_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "service.toml"
    monkeypatch.setenv("ARMHIL_SERVICE", str(file))
    assert read_service(None) == Service()
    with pytest.raises(ServiceError, match=r"host 0\.0\.0\.0: others can reach it, so it needs a token"):
        read_service(None, host="0.0.0.0")
    file.write_text('format = 1\nhost = "0.0.0.0"\nread_token_env = "ARMHIL_TEST_READ"\n')
    with pytest.raises(ServiceError, match="has 0 characters; allowed: at least 16"):
        read_service(None)
    monkeypatch.setenv("ARMHIL_TEST_READ", READ)
    assert read_service(None).read_token == READ
    file.write_text("format = 1\ndrive = true\n")
    with pytest.raises(ServiceError, match="drive_token_env"):
        read_service(None)
    both = [f'{right}_token_env = "ARMHIL_TEST_READ"' for right in ("drive", "read")]
    file.write_text("\n".join(["format = 1", "drive = true", *both]))
    with pytest.raises(ServiceError, match="the same token"):
        read_service(None)
    file.write_text("format = 1\nport = 99999\n")
    with pytest.raises(ServiceError, match=r"service\.toml:2: port"):
        read_service(None)


def test_a_body_has_one_length_and_a_host_its_name(client: TestClient) -> None:
    both = {"Content-Length": "3", "Transfer-Encoding": "chunked"}
    answer = client.request("POST", "/login", headers=both, content=b"a=b")
    assert answer.status_code == 400 and answer.json()["detail"] == "a body has one length"
    assert client.get("/", headers={"Host": "testserver"}).status_code == 421


def test_guesses_of_a_token_are_slowed(client_of: Clients) -> None:
    client = client_of(Service(read_token=READ))
    codes = [client.post("/login", data={"token": f"wrong {k}"}).status_code for k in range(MOST_GUESSES)]
    assert codes == [401] * MOST_GUESSES
    late = client.post("/login", data={"token": READ}, follow_redirects=False)  # the right one waits too
    assert late.status_code == 429 and 0 < int(late.headers["Retry-After"]) <= 60

    now = [0.0]
    guesses = Guesses(lambda: now[0])
    for _ in range(MOST_GUESSES):
        assert guesses.wait("a") == 0
        guesses.wrong("a")
    assert guesses.wait("a") == 60 and guesses.wait("b") == 0
    now[0] = 60.0
    assert guesses.wait("a") == 0
