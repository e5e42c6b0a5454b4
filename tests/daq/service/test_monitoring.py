"""The shipped rules and board, read by a real Prometheus; an alert through a real Alertmanager."""

from __future__ import annotations

import json
import re
import shutil
import socket
import subprocess
import threading
import time
import urllib.parse
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from daq.catalogue.database import Catalogue
from daq.service.settings import Service
from tests.daq.service.serving import running

SHIPPED = Path(str(files("daq").joinpath("templates", "monitoring")))


def of_debian(name: str, package: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not here; Debian's package {package} has it")
    return found


def board_expressions() -> list[str]:
    board = json.loads((SHIPPED / "grafana.json").read_text())
    found = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    return [expression.replace('"$arm"', '".*"') for expression in found]


def test_what_they_ask_for_is_in_the_metrics(client: TestClient) -> None:
    metrics = client.get("/metrics").text
    texts = [(SHIPPED / "alerts.yml").read_text(), *board_expressions()]
    asked = {name for text in texts for name in re.findall(r"\barmhil_[a-z_]+", text)}
    assert asked and all(f"# TYPE {name} gauge" in metrics for name in asked), asked
    served = {
        name: client.get(f"/monitoring/{name}") for name in ("alerts.yml", "prometheus.yml", "grafana.json")
    }
    assert all(answer.content == (SHIPPED / name).read_bytes() for name, answer in served.items())
    assert client.get("/monitoring/..%2farm.html.j2").status_code == 404
    panels = json.loads(served["grafana.json"].content)["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels) >= 6


class _Inbox(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.server.told.append(json.loads(body))  # type: ignore[attr-defined]
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: Any) -> None:
        """Nobody reads it."""


@contextmanager
def inbox() -> Iterator[tuple[int, list[dict[str, Any]]]]:
    server = HTTPServer(("127.0.0.1", 0), _Inbox)
    told: list[dict[str, Any]] = []
    server.told = told  # type: ignore[attr-defined]
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server.server_port, told
    finally:
        server.shutdown()
        server.server_close()


@contextmanager
def started(command: list[str], log: Path) -> Iterator[None]:
    with log.open("w") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
        try:
            yield
        finally:
            process.terminate()
            process.wait(20)


def free_port() -> int:
    with closing(socket.create_server(("127.0.0.1", 0))) as found:
        return int(found.getsockname()[1])


def until(said: Callable[[], Any], seconds: float, log: Path) -> Any:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            if found := said():
                return found
        except OSError:
            pass
        time.sleep(0.2)
    raise AssertionError(f"not within {seconds} s: {log.read_text()[-2000:]}")


def asked(port: int, path: str, **query: str) -> Any:
    url = f"http://127.0.0.1:{port}{path}?{urllib.parse.urlencode(query)}"
    with urllib.request.urlopen(url, timeout=5) as answer:
        return json.load(answer)["data"]


@pytest.mark.slow
def test_promtool_accepts_the_rules(tmp_path: Path) -> None:
    promtool = of_debian("promtool", "prometheus")
    done = subprocess.run(
        [promtool, "check", "rules", str(SHIPPED / "alerts.yml")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and "8 rules found" in done.stdout, done.stdout + done.stderr
    for name in ("alerts.yml", "prometheus.yml"):
        shutil.copy(SHIPPED / name, tmp_path / name)
    checked = [promtool, "check", "config", str(tmp_path / "prometheus.yml")]
    assert subprocess.run(checked, capture_output=True, check=False).returncode == 0


@pytest.mark.slow
@pytest.mark.timeout(180)
def test_the_alert_of_a_failed_check_arrives(filled: Catalogue, tmp_path: Path) -> None:
    """Service → Prometheus with the shipped rules → Alertmanager → a webhook; the board is answered."""
    prometheus = of_debian("prometheus", "prometheus")
    alertmanager = of_debian("prometheus-alertmanager", "prometheus-alertmanager")
    with ExitStack() as stack:
        port = stack.enter_context(running(Service(), filled, tmp_path))
        inbox_port, told = stack.enter_context(inbox())
        at, listens = free_port(), free_port()
        manager = tmp_path / "alertmanager.yml"
        manager.write_text(
            "route: {receiver: hook, group_by: [alertname], group_wait: 0s}\n"
            f"receivers: [{{name: hook, webhook_configs: [{{url: 'http://127.0.0.1:{inbox_port}/'}}]}}]\n"
        )
        config = (SHIPPED / "prometheus.yml").read_text().replace("127.0.0.1:8090", f"127.0.0.1:{port}")
        config = config.replace("scrape_interval: 1m", "scrape_interval: 1s")
        assert str(port) in config and "1s" in config
        config += (
            "global: {evaluation_interval: 1s}\n"
            f"alerting: {{alertmanagers: [{{static_configs: [{{targets: ['127.0.0.1:{at}']}}]}}]}}\n"
        )
        (tmp_path / "prometheus.yml").write_text(config)
        shutil.copy(SHIPPED / "alerts.yml", tmp_path / "alerts.yml")
        logs = tmp_path / "alertmanager.log", tmp_path / "prometheus.log"
        run_manager = [
            alertmanager,
            f"--config.file={manager}",
            f"--storage.path={tmp_path / 'am'}",
            f"--web.listen-address=127.0.0.1:{at}",
            "--cluster.listen-address=",
        ]
        run_prometheus = [
            prometheus,
            f"--config.file={tmp_path / 'prometheus.yml'}",
            f"--storage.tsdb.path={tmp_path / 'tsdb'}",
            f"--web.listen-address=127.0.0.1:{listens}",
        ]
        stack.enter_context(started(run_manager, logs[0]))
        stack.enter_context(started(run_prometheus, logs[1]))
        until(lambda: told, 90, logs[1])
        alerts = [alert for message in told for alert in message["alerts"]]
        (failed,) = [a for a in alerts if a["labels"]["alertname"] == "ArmhilCheckFailed"][:1]
        assert failed["labels"]["arm"] == "emps-sim" and failed["labels"]["severity"] == "critical"
        assert failed["annotations"]["summary"].startswith("emps-sim: something has moved")
        firing = {a["labels"]["alertname"] for a in asked(listens, "/api/v1/alerts")["alerts"]}
        assert firing == {"ArmhilCheckFailed"}
        for expression in board_expressions():
            assert asked(listens, "/api/v1/query", query=expression)["result"], expression
