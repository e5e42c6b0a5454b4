"""What the pages show of a filled catalogue."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from fastapi.testclient import TestClient
from markupsafe import escape

from daq.catalogue import arms, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity, Course
from daq.service.app import create_app
from daq.service.pages import _first_choice
from daq.service.settings import Service
from daq.service.trends import trend_of
from tests.daq.service.test_trends import course_of

PAGES = (
    "/",
    "/runs",
    "/runs?arm=emps-sim",
    "/arms/emps-sim",
    "/runs/1",
    "/runs/12",
    "/docs",
    "/runs/12/live",
    "/login",
)


@pytest.mark.parametrize("path", PAGES)
def test_every_page_stands_alone(client: TestClient, path: str) -> None:
    answer = client.get(path)
    assert answer.status_code == 200
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    linked = re.findall(r'(?:href|src|action)="([^"]+)"', answer.text)
    assert linked
    assert all(link.startswith(("/", "#", "?", "data:,")) and not link.startswith("//") for link in linked)
    assert "<script>alert" not in answer.text and "first <b>run" not in answer.text
    assert answer.text.count("<h1") == 1 and '<html lang="en">' in answer.text
    for link in set(linked):
        if link.startswith("/") and "/login" not in link:
            assert client.get(link.partition("#")[0]).status_code == 200, link


def test_arms_at_a_glance(client: TestClient) -> None:
    text = client.get("/").text
    assert "emps-sim" in text and "failed" in text and "Coulomb friction of joint 1 +20\u00a0%" in text
    assert "run 1, accepted less than an hour ago by Ada" in text and " UTC, less than an hour ago" in text


def test_a_run_shows_gates_findings_and_parameters(client: TestClient) -> None:
    text = client.get("/runs/12").text
    assert text.count('<svg class="gate') == 3
    assert "more Coulomb friction on joint 1" in text
    assert ">2.00<" in text and ">0.200<" in text  # the gap before and after
    assert "⚠ 4 SYNC cycles were missed" in text
    for name in ("ZZ1R", "Fv1", "Fc1", "off1"):
        assert f">{name}</a>" in text
    assert "No curves: nothing was recorded" in text


def test_a_trend_marks_what_left_the_band(client: TestClient) -> None:
    text = client.get("/arms/emps-sim?parameter=Fc1").text
    chosen = text[text.index('class="card chart"') : text.index("As a table")]
    assert chosen.count('class="trend wide"') == chosen.count('class="trend narrow"') == 1
    assert chosen.count('class="out"') == 2 and chosen.count('class="in"') == 22  # both sizes
    assert text.count("◆ outside</td>") == 1
    assert '<h2 id="trend">Fc1' in client.get("/arms/emps-sim?parameter=nonsense").text


def test_the_reference_of_the_interface_is_whole_and_asks_nobody(client: TestClient) -> None:
    """Each route of /openapi.json with its parameters and answers, on a page of this service alone."""
    text = client.get("/docs").text
    described = client.get("/openapi.json").json()["paths"]
    assert "/api/arms/{label}/trend/{parameter}" in described
    shared = text[text.index('id="answers"') :].partition("</section>")[0]
    assert shared.count("<dt>") == 6 and "<dt>503</dt>" in shared and "<dt>409</dt>" not in shared
    for path, operations in described.items():
        for verb, operation in operations.items():
            assert f"<code>{verb.upper()} {path}</code></h3>" in text
            section = text[text.index(f"<code>{verb.upper()} {path}</code></h3>") :].partition("</section>")[
                0
            ]
            assert escape(operation["summary"]) in section
            assert all(f"<code>{p['name']}</code>" in section for p in operation.get("parameters", ()))
            assert all(f"<dt>{code}</dt>" in section + shared for code in operation["responses"])
    assert "whole number, 1 to 1000; 100 where it is left out" in text
    assert "curl -X POST" in text and "http://localhost/api/fleet/{place}/check" in text
    assert '<script src="/static/' in text and text.count("//") == text.count("http://localhost/")


def test_an_empty_catalogue_says_what_to_do(tmp_path) -> None:
    with Catalogue() as empty:
        client = TestClient(create_app(Service(), empty, tmp_path), base_url="http://localhost")
        assert "armhil demo" in client.get("/").text
        assert client.get("/runs").status_code == 200
        assert client.get("/metrics").status_code == 200


def test_reports_are_pages_of_their_own(client: TestClient) -> None:
    answer = client.get("/api/runs/12/report")
    assert "one report" in answer.text
    assert answer.headers["content-security-policy"].startswith("sandbox")
    assert "armhil-run-12.html" in answer.headers["content-disposition"]


def test_metrics(client: TestClient) -> None:
    text = client.get("/metrics").text
    assert 'armhil_check_verdict{arm="emps-sim",verdict="failed"} 1.0' in text
    assert 'armhil_check_verdict{arm="emps-sim",verdict="ok"} 0.0' in text
    assert 'armhil_torque_change_share{arm="emps-sim",joint="1"} 0.1' in text
    assert 'armhil_missed_cycles{arm="emps-sim"} 0.0' in text
    assert 'armhil_baseline_suspect{arm="emps-sim"} 0.0' in text
    assert "armhil_baseline_age_seconds" in text
    assert 'armhil_check_unfinished{arm="emps-sim"} 0.0' in text


def test_a_check_without_a_verdict_is_no_fine_arm(client: TestClient, filled: Catalogue) -> None:
    """The verdict on show is that of an older check, and every place says so."""
    (arm,) = arms.every(filled)
    identity = ArmIdentity("emps", (7,), "0" * 64, simulated=True)
    run = runs.begin(filled, identity, "check")
    assert "ended without a verdict" not in client.get("/").text  # it is under way
    runs.finish(filled, run.id, "aborted", reason="the drive of joint 1 has a fault")
    for path in ("/", f"/arms/{arm.label}"):
        text = client.get(path).text
        assert (
            f'<a href="/runs/{run.id}">run {run.id}</a>) ended without a verdict; what is shown is older'
            in text
        )
    assert 'armhil_check_unfinished{arm="emps-sim"} 1.0' in client.get("/metrics").text


def test_the_band_is_of_clean_nights(client: TestClient) -> None:
    """A night on which something was found widens nothing; a few nights make no band."""
    values = [10.0, 10.1, 9.9, 10.05, 9.95, 20.0]
    points = course_of(values, 0.01)
    trend = trend_of(points, 1, {1, 2, 3, 4, 5})
    assert trend.low == pytest.approx(10.0 - 3 * np.std(values[:5], ddof=1))
    assert [inside for *_, inside in trend.points] == [False, True, True, True, True, True]
    few = trend_of(points, 1, {1, 2, 3, 4})
    assert (few.low, few.high, few.clean) == (None, None, 4)


def test_what_moved_farthest_is_shown_first() -> None:
    """In σ of the difference, where the last check named nothing that there is a trend of."""

    def course(name: str, sigma: float, *values: float) -> Course:
        return replace(course_of(list(values), sigma), name=name)

    trends = {
        "ZZ1R": course("ZZ1R", 1.0, 10.0, 90.0, 11.0),
        "Fv1": course("Fv1", 0.1, 2.0, 2.0, 1.7),
        "off1": course("off1", 0.0, 0.0, 0.0, 9.0),
    }
    assert _first_choice(trends, None) == "Fv1"
    assert _first_choice({"ZZ1R": course("ZZ1R", 1.0, 10.0), "Fv1": course("Fv1", 0.1, 2.0)}, None) == "ZZ1R"
    assert _first_choice({}, None) == ""


def test_rest(client: TestClient) -> None:
    (arm,) = client.get("/api/arms").json()
    assert arm["last_check"]["verdict"] == "failed" and arm["baseline"]["events"][0]["author"] == "Ada"
    run = client.get("/api/runs/12").json()
    assert run["models"][0]["parameters"][2]["name"] == "Fc1" and run["findings"][0]["joints"] == [1]
    assert len(client.get("/api/runs?limit=5").json()) == 5
    assert len(client.get("/api/arms/emps-sim/trend/Fc1").json()) == 12
    assert len(client.get("/api/arms/emps-sim/checks").json()) == 11
    assert "capture" not in run  # paths of the machine stay inside
