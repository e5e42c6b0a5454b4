"""Notifications: to servers that answer late, wrongly or not at all; never in the check's way."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import SimpleNamespace

import pytest

from daq.catalogue import arms, checks, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity
from daq.check.request import Verdict
from daq.notify.notify import Message, message_of, notify_of, start_sender
from daq.notify.sending import masked, send_all
from daq.notify.settings import NotifyError, read_notify
from daq.notify.told import note_told, settle_told

MESSAGE = Message("tx40", "failed", "ok", "Coulomb friction of joint 2 +20 %", "http://localhost/runs/3")


class _Hook(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.seen.append((self.headers.get("Authorization"), json.loads(body)))  # type: ignore[attr-defined]
        code = self.server.codes.pop(0)  # type: ignore[attr-defined]
        self.send_response(code)
        if 300 <= code < 400:
            self.send_header("Location", self.server.elsewhere)  # type: ignore[attr-defined]
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def hook(*codes: int) -> Iterator[HTTPServer]:
    server = HTTPServer(("127.0.0.1", 0), _Hook)
    server.codes, server.seen = list(codes), []  # type: ignore[attr-defined]
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()


@contextmanager
def mail_server() -> Iterator[tuple[int, list[str]]]:
    """A mail server of a few lines that keeps what it is told (RFC 5321)."""
    listening = socket.create_server(("127.0.0.1", 0))
    heard: list[str] = []

    def answer() -> None:
        connection, _ = listening.accept()
        with connection, connection.makefile("rwb") as file:
            data = False

            def say(text: str) -> None:
                file.write(text.encode() + b"\r\n")
                file.flush()

            say("220 here")
            for raw in file:
                line = raw.decode().rstrip("\r\n")
                heard.append(line)
                if data:
                    if line == ".":
                        data = False
                        say("250 kept")
                elif line.upper() == "DATA":
                    data = True
                    say("354 go on")
                elif line.upper() == "QUIT":
                    say("221 bye")
                    return
                else:
                    say("250 fine")

    thread = threading.Thread(target=answer, daemon=True)
    thread.start()
    try:
        yield listening.getsockname()[1], heard
    finally:
        thread.join(5)
        listening.close()


def test_an_address_is_logged_without_its_secrets() -> None:
    assert masked("https://user:word@example.org:8443/hooks/T0/B0?key=1#x") == "https://example.org:8443/…"
    assert masked("http://example.org/") == masked("http://example.org") == "http://example.org"
    assert masked("http://example.org?key=1") == "http://example.org/…"


def test_a_redirect_is_not_followed_and_no_token_goes_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOOK_TOKEN", "secret")
    for code in (301, 302, 303, 307, 308):
        with hook(200) as elsewhere, hook(code) as server:
            server.elsewhere = f"http://127.0.0.1:{elsewhere.server_port}/taken"  # type: ignore[attr-defined]
            url = f"http://127.0.0.1:{server.server_port}/services/T0/hidden?key=also"
            file = settings_file(
                tmp_path, f'attempts = 1\n[[webhook]]\nurl = "{url}"\ntoken_env = "HOOK_TOKEN"\n'
            )
            (tmp_path / "log").touch(0o644)
            assert not send_all(read_notify(file), MESSAGE, tmp_path / "log", lambda _: None)
            assert elsewhere.seen == []  # type: ignore[attr-defined]
            assert len(server.seen) == 1  # type: ignore[attr-defined]
        log = (tmp_path / "log").read_text()
        assert f"webhook http://127.0.0.1:{server.server_port}/…: attempt 1 failed" in log
        assert not any(word in log for word in ("hidden", "also", "secret", "taken"))
        assert (tmp_path / "log").stat().st_mode & 0o777 == 0o600


def settings_file(folder: Path, text: str) -> Path:
    file = folder / "notify.toml"
    file.write_text(f"format = 1\n{text}")
    return file


def test_a_webhook_that_fails_twice_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOOK_TOKEN", "secret")
    pauses: list[float] = []
    with hook(500, 503, 200) as server:
        url = f"http://127.0.0.1:{server.server_port}/x"
        file = settings_file(tmp_path, f'[[webhook]]\nurl = "{url}"\ntoken_env = "HOOK_TOKEN"\n')
        assert send_all(read_notify(file), MESSAGE, tmp_path / "log", pauses.append)
        assert len(server.seen) == 3  # type: ignore[attr-defined]
        assert server.seen[0] == ("Bearer secret", MESSAGE.as_dict())  # type: ignore[attr-defined]
    assert pauses == [5.0, 10.0]
    log = (tmp_path / "log").read_text()
    assert log.count("failed: HTTPError") == 2 and "sent in attempt 3" in log and "secret" not in log


def test_nobody_there(tmp_path: Path) -> None:
    file = settings_file(tmp_path, 'attempts = 2\n[[webhook]]\nurl = "http://127.0.0.1:9/x"\n')
    assert not send_all(read_notify(file), MESSAGE, tmp_path / "log", lambda pause: None)
    assert (tmp_path / "log").read_text().count(" failed: ") == 2


def test_one_that_is_reached_is_told_once(tmp_path: Path) -> None:
    with hook(200) as server:
        hooks = f'[[webhook]]\nurl = "http://127.0.0.1:{server.server_port}/x"\n'
        file = settings_file(tmp_path, f'attempts = 3\n{hooks}[[webhook]]\nurl = "http://127.0.0.1:9/x"\n')
        assert not send_all(read_notify(file), MESSAGE, tmp_path / "log", lambda pause: None)
        assert len(server.seen) == 1  # type: ignore[attr-defined]


def test_mail(tmp_path: Path) -> None:
    with mail_server() as (port, heard):
        where = f'host = "127.0.0.1"\nport = {port}\nencryption = "none"\n'
        mail = f'{where}sender = "arm@x.example"\nto = ["a@x.example"]\n'
        file = settings_file(tmp_path, f"[[mail]]\n{mail}")
        assert send_all(read_notify(file), MESSAGE, tmp_path / "log", lambda pause: None)
    text = "\n".join(heard)
    assert "Subject: armhil: tx40 is failed (was ok)" in text
    assert "Coulomb friction of joint 2 +20 %" in text and "http://localhost/runs/3" in text
    assert any(line.lower().startswith("rcpt to:<a@x.example>") for line in heard)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # apprise's own imports
def test_apprise_sends_what_it_is_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("apprise")
    with hook(200) as server:
        monkeypatch.setenv("SERVICE_URL", f"json://127.0.0.1:{server.server_port}/x")
        file = settings_file(tmp_path, '[[apprise]]\nurl_env = "SERVICE_URL"\n')
        assert send_all(read_notify(file), MESSAGE, tmp_path / "log", lambda pause: None)
        assert server.seen[0][1]["title"] == MESSAGE.subject  # type: ignore[attr-defined]


def test_a_missing_secret_is_said(tmp_path: Path) -> None:
    file = settings_file(tmp_path, 'attempts = 1\n[[apprise]]\nurl_env = "NO_SUCH_VARIABLE"\n')
    assert not send_all(read_notify(file), MESSAGE, tmp_path / "log", lambda pause: None)
    assert "NO_SUCH_VARIABLE is not set" in (tmp_path / "log").read_text()


def result(verdict: str, previous: str) -> SimpleNamespace:
    return SimpleNamespace(
        arm="tx40", verdict=Verdict(verdict), previous=previous, sentence="s", run=3, report=Path("r.html")
    )


@pytest.mark.parametrize(
    ("verdict", "before", "told"),
    [
        ("ok", "ok", False),
        ("ok", "", False),
        ("failed", "failed", False),
        ("failed", "ok", True),
        ("ok", "failed", True),
        ("warning", "", True),
    ],
)
def test_only_a_new_verdict_is_told(verdict: str, before: str, told: bool) -> None:
    message = message_of(result(verdict, "unknown"), "http://host/", before)  # type: ignore[arg-type]
    assert (message is not None) == told
    if message is not None:
        assert message.link == "http://host/runs/3"


def test_the_check_does_not_wait(tmp_path: Path) -> None:
    """The receiver accepts and never answers; the caller has long gone on."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}/x"
        file = settings_file(tmp_path, f'attempts = 1\ntimeout = 1.0\n[[webhook]]\nurl = "{url}"\n')
        sender = start_sender(file, MESSAGE)
        assert sender.poll() is None  # it still tries, and this line is reached
        assert sender.wait(60) == 1
    assert "failed" in (tmp_path / "notify.log").read_text()


def test_files_that_are_wrong(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = settings_file(tmp_path, '[[webhook]]\nurl = "ftp://x"\n')
    with pytest.raises(NotifyError, match=r"notify\.toml"):
        notify_of(result("failed", "ok"), None, bad)  # type: ignore[arg-type]
    monkeypatch.setenv("ARMHIL_NOTIFY", str(bad))
    assert notify_of(result("failed", "ok"), None) is None  # type: ignore[arg-type]
    monkeypatch.setenv("ARMHIL_NOTIFY", str(tmp_path / "none.toml"))
    assert notify_of(result("failed", "ok"), None) is None  # type: ignore[arg-type]


def test_what_nobody_was_told_of_is_told_by_the_next_check(tmp_path: Path) -> None:
    """A check that was killed before it told, receivers that were out of reach: nothing gets lost."""
    identity = ArmIdentity("tx40", (1,), "0" * 64)

    def checked(catalogue: Catalogue, verdict: str) -> SimpleNamespace:
        run = runs.begin(catalogue, identity, "check")
        kept = checks.add(catalogue, run.id, verdict, "s", {"state": "changed"})
        return SimpleNamespace(**vars(result(verdict, "")) | {"run": run.id, "check": kept.id})

    def tell(catalogue: Catalogue, found: SimpleNamespace, file: Path) -> bool:
        sender = notify_of(found, catalogue, file)  # type: ignore[arg-type]
        if sender is not None:
            sender.wait(240)
        return sender is not None

    nowhere = settings_file(tmp_path, 'attempts = 1\n[[webhook]]\nurl = "http://127.0.0.1:9/x"\n')
    with hook(*[200] * 9) as server, Catalogue() as catalogue:
        arm = arms.register(catalogue, identity)
        checked(catalogue, "failed")  # killed before it told
        assert tell(catalogue, checked(catalogue, "failed"), nowhere)
        assert checks.last_told(catalogue, arm.id) == ""
        (tmp_path / "there").mkdir()
        url = f"http://127.0.0.1:{server.server_port}/x"
        there = settings_file(tmp_path / "there", f'[[webhook]]\nurl = "{url}"\n')
        assert tell(catalogue, checked(catalogue, "failed"), there)
        assert not tell(catalogue, checked(catalogue, "failed"), there)
        assert tell(catalogue, checked(catalogue, "ok"), there)
        newest = checks.of_arm(catalogue, arm.id, limit=1)[0]
        assert newest.details["state"] == "changed" and "told" in newest.details
        seen = [(body["verdict"], body["previous"]) for _, body in server.seen]  # type: ignore[attr-defined]
        assert seen == [("failed", ""), ("ok", "failed")]


@contextmanager
def no_http() -> Iterator[int]:
    """A server that answers what is no HTTP."""
    listening = socket.create_server(("127.0.0.1", 0))

    def answer() -> None:
        connection, _ = listening.accept()
        with connection:
            connection.recv(65536)
            connection.sendall(b"220 mail.example ready\r\n")

    thread = threading.Thread(target=answer, daemon=True)
    thread.start()
    try:
        yield listening.getsockname()[1]
    finally:
        thread.join(5)
        listening.close()


def test_one_that_answers_no_http_keeps_nobody_else_from_being_told(tmp_path: Path) -> None:
    with no_http() as port, hook(200) as server:
        urls = f"http://127.0.0.1:{port}/hidden", f"http://127.0.0.1:{server.server_port}/x"
        hooks = "".join(f'[[webhook]]\nurl = "{url}"\n' for url in urls)
        file = settings_file(tmp_path, f"attempts = 1\n{hooks}")
        assert not send_all(read_notify(file), MESSAGE, tmp_path / "log", lambda pause: None)
        assert len(server.seen) == 1  # type: ignore[attr-defined]
    log = (tmp_path / "log").read_text()
    assert "attempt 1 failed: BadStatusLine" in log and "hidden" not in log and "mail.example" not in log


def test_a_database_that_dies_before_it_is_said_who_was_told_has_nobody_told_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = settings_file(tmp_path, "")
    with Catalogue() as catalogue:
        run = runs.begin(catalogue, ArmIdentity("tx40", (1,), "0" * 64), "check")
        kept = checks.add(catalogue, run.id, "failed", "s", {"state": "changed"})
        found = SimpleNamespace(**vars(result("failed", "")) | {"run": run.id, "check": kept.id})
        with monkeypatch.context() as patched:
            patched.setenv("ARMHIL_CATALOGUE", "postgresql://armhil@127.0.0.1:9/gone")
            note_told(kept.id, file)
            other = tmp_path / f"notify.told-{kept.id}"
            assert other.stat().st_mode & 0o777 == 0o600
            settle_told(catalogue, file)
        arm = runs.get(catalogue, run.id).arm_id
        assert checks.last_told(catalogue, arm) == "" and other.exists(), "it is of another catalogue"
        other.write_text(catalogue.url.render_as_string())
        assert notify_of(found, catalogue, file) is None, "nobody is told again"
        assert checks.last_told(catalogue, arm) == "failed" and not other.exists()
