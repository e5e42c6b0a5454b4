"""Clients that ask for nothing, slowly, or never read: each is cut, and nobody else waits."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from fastapi import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import Message

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import ArmIdentity
from daq.cli.entry import main
from daq.service import api, connections
from daq.service.connections import listening
from daq.service.live import Broadcaster, EventStream
from daq.service.settings import Service, ServiceError
from daq.session.spool import spool_path
from tests.daq.service.serving import running


@pytest.fixture
def port(filled: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    monkeypatch.setattr(connections, "REQUEST_TIME", 0.4)
    monkeypatch.setattr(connections, "READING_TIME", 0.4)
    monkeypatch.setattr(connections, "LINGER", 0.2)
    with running(Service(), filled, tmp_path) as found:
        yield found


def connected(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), 10)


def is_cut(client: socket.socket) -> bool:
    """Whether the other side closes the connection (else the socket's own time runs out)."""
    try:
        while client.recv(65536):
            pass
    except ConnectionResetError:
        return True
    return True


def test_who_never_asks_is_cut(port: int) -> None:
    with closing(connected(port)) as client:
        begun = time.monotonic()
        assert is_cut(client)
        assert time.monotonic() - begun < 5.0


@pytest.mark.parametrize(
    "head",
    [
        b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ",
        b"POST /login HTTP/1.1\r\nHost: localhost\r\nContent-Length: 16000\r\n\r\n",
        b"GET /api/arms HTTP/1.1\r\nHost: localhost\r\n\r\nGET /api/arms HTTP/1.1\r\nX: ",
    ],
    ids=["head", "body", "second request"],
)
def test_who_asks_a_byte_at_a_time_is_cut(port: int, head: bytes) -> None:
    """Each byte comes well within the time for the whole request, which does not begin anew with it."""
    with closing(connected(port)) as client:
        client.sendall(head)
        begun = time.monotonic()
        client.settimeout(0.05)
        cut = False
        while not cut and time.monotonic() - begun < 8.0:
            try:
                client.sendall(b"a")
                cut = client.recv(65536) == b""
            except TimeoutError:
                continue
            except OSError:
                cut = True
        assert cut


def test_who_never_reads_is_cut_and_gives_its_place_back(
    port: int, filled: Catalogue, tmp_path: Path
) -> None:
    """A live run of megabytes to a client with a small window."""
    capture = tmp_path / "capture.mcap"
    spool = spool_path(capture)
    spool.write_text('{"kind":"begin"}\n')
    identity = ArmIdentity("emps", (7,), "0" * 64, simulated=True)
    run = runs.begin(filled, identity, "check", capture=str(capture))
    with closing(socket.socket()) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.settimeout(10)
        client.connect(("127.0.0.1", port))
        client.sendall(f"GET /api/runs/{run.id}/live HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        deadline = time.monotonic() + 20
        line = '{"kind":"sample","x":"' + "x" * 60_000 + '"}\n'
        cut = False
        while not cut and time.monotonic() < deadline:
            with spool.open("a") as file:
                file.write(line * 4)
            time.sleep(0.1)  # the service looks ten times a second
            try:
                client.sendall(b"\r\n")
            except OSError:
                cut = True
        assert cut


def test_little_is_kept_for_who_never_reads() -> None:
    """Else hundreds of pages are made for each before the time to read them begins."""
    with closing(listening("127.0.0.1", 0)) as listener, closing(socket.socket()) as client:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.connect(listener.getsockname())
        answering, _ = listener.accept()
        kept = 0
        with closing(answering), contextlib.suppress(BlockingIOError):
            answering.setblocking(False)
            while kept < 2_000_000:
                kept += answering.send(bytes(65536))
    assert kept < 300_000


def test_a_database_that_keeps_one_waiting_holds_nobody_else_up(
    port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who looks on asks it beside the loop that accepts, serves and cuts all others."""
    asked, answer = threading.Event(), threading.Event()

    def waits(catalogue: Catalogue, number: int) -> None:
        asked.set()
        answer.wait(20)
        raise HTTPException(404)

    monkeypatch.setattr(api, "run_of", waits)
    with closing(connected(port)) as looking, closing(connected(port)) as other:
        try:
            looking.sendall(b"GET /api/runs/1/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert asked.wait(10)
            other.settimeout(5)
            other.sendall(b"GET /static/service.css HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            assert other.recv(65536).startswith(b"HTTP/1.1 200 ")
            assert is_cut(other)
        finally:
            answer.set()
        assert looking.recv(65536).startswith(b"HTTP/1.1 404 ")


def test_a_client_that_is_gone_before_the_first_event_keeps_no_place(tmp_path: Path) -> None:
    """The place is taken when the request is answered; no piece has to be sent for it to be given back."""
    broadcaster = Broadcaster()

    async def gone() -> None:
        stream = EventStream(broadcaster.events(tmp_path / "x.live", lambda: False))
        assert broadcaster.looking == 1

        async def send(message: Message) -> None:
            raise OSError("gone")

        async def receive() -> Message:
            return {"type": "http.disconnect"}

        with pytest.raises(ClientDisconnect):
            await stream({"type": "http", "asgi": {"spec_version": "2.4"}}, receive, send)
        assert broadcaster.looking == 0 and broadcaster.reading == 0

    asyncio.run(gone())


def test_a_busy_port_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    with closing(listening("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        monkeypatch.setattr("sys.argv", ["armhil", "serve", "--port", str(port)])
        with pytest.raises(SystemExit) as ended:
            main()
    said = capsys.readouterr()
    assert ended.value.code == 2 and said.out == ""
    assert said.err == (
        f"armhil: 127.0.0.1:{port}: cannot be listened on: Address already in use;"
        " allowed: another --port, or 0 for a free one; see `armhil serve --help`\n"
    )
    with pytest.raises(ServiceError, match=r"203\.0\.113\.1:0: cannot be listened on: "):
        listening("203.0.113.1", 0)
