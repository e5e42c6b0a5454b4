"""The report: well formed, complete, harmless, small and the same each time."""

from __future__ import annotations

import base64
import hashlib
import html
import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.report.columns import column_plot
from daq.report.page import ClosedLoopTrace, MotionTrace, ReportContent, write_report
from daq.report.pictures import end_to_end, extremes, nice_ticks
from daq.report.templates import ReportError
from daq.report.traces import PLOTS
from ident.verdicts import ColumnCheck, Gate, GateName, Verdict
from tests.daq.report.contents import INJECTION, JOINTS, content, names, robot

VOID = {"meta", "img", "br", "link", "input", "hr"}


class _Nesting(HTMLParser):
    """Checks that every element is closed in order, and keeps what a browser would act on."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.attributes: list[tuple[str, str | None]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def parsed(page: str) -> _Nesting:
    parser = _Nesting()
    parser.feed(page)
    parser.close()
    assert parser.open == []
    return parser


@pytest.fixture(params=["exogenous", "endogenous", "instruments_invalid", "not_testable"])
def verdict(request: pytest.FixtureRequest) -> Verdict:
    chosen: Verdict = request.param
    return chosen


def write(tmp_path: Path, shown: ReportContent) -> str:
    path = tmp_path / "report.html"
    write_report(path, shown)
    return path.read_text(encoding="utf-8")


def test_page_is_well_formed_complete_and_small(tmp_path: Path, verdict: Verdict) -> None:
    page = write(tmp_path, content(verdict))
    assert len(page.encode()) <= 300_000
    root = ET.fromstring(page)
    rows = [cell.text for cell in root.iter("th") if cell.get("scope") == "row"]
    assert set(names(JOINTS)) <= set(rows)
    assert len(root.findall(".//figure")) == JOINTS
    assert all(table.find("caption") is not None for table in root.iter("table"))
    for label in ("Seed", "Cycle time", "Missed cycles"):
        assert label in parsed(page).text


def test_page_asks_for_nothing_from_elsewhere(tmp_path: Path, verdict: Verdict) -> None:
    page = write(tmp_path, content(verdict))
    parser = parsed(page)
    assert "http" not in page.replace("http-equiv", "") and "@import" not in page and "url(" not in page
    assert page.count("<script") == 1 and f"<script>{PLOTS}</script>" in page
    assert not any(word in PLOTS for word in ("fetch", "XMLHttp", "import", "eval", "WebSocket", "Function"))
    assert not parser.tags & {"link", "img", "iframe", "object", "embed", "base", "form"}
    assert not [name for name, _ in parser.attributes if name.startswith("on") or name == "src"]
    assert all(str(value).startswith("#") for name, value in parser.attributes if name == "href")


def test_injected_markup_is_shown_as_text(tmp_path: Path) -> None:
    page = write(tmp_path, content())
    assert INJECTION not in page
    assert page.count(html.escape(INJECTION).replace("&quot;", "&#34;").replace("&#x27;", "&#39;")) >= 6


def test_ids_are_unique_and_links_lead_somewhere(tmp_path: Path, verdict: Verdict) -> None:
    parser = parsed(write(tmp_path, content(verdict)))
    ids = [value for name, value in parser.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    wanted = {str(value)[1:] for name, value in parser.attributes if name == "href"}
    wanted |= {str(value) for name, value in parser.attributes if name == "aria-labelledby"}
    assert wanted <= set(ids)


def test_a_report_may_run_its_one_script_and_nothing_else(tmp_path: Path) -> None:
    parser = parsed(write(tmp_path, content()))
    policy = next(
        str(value) for name, value in parser.attributes if name == "content" and "src" in str(value)
    )
    digest = base64.b64encode(hashlib.sha256(PLOTS.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy and policy.startswith("default-src 'none';")
    assert "unsafe-inline" not in policy.partition("script-src")[2] and "PLOTS" not in policy


def test_position_and_following_error_are_shown(tmp_path: Path) -> None:
    shown = content()
    time = np.linspace(0.0, 4.0, 1001)
    n = len(shown.joint_names)
    reference = np.sin(np.outer(time, np.arange(1, n + 1)))
    motion = MotionTrace(np.r_[time, time], np.r_[reference - 2e-3, reference], np.r_[reference, reference])
    page = write(tmp_path, replace(shown, motion=motion))
    section = page[page.index('id="position"') : page.index('id="parameters"')]
    assert section.count("<figure") == n and section.count("measured − reference") == n
    assert section.count("largest following error</span> <b>0.00200 rad</b>") == n
    assert section.count('class="start"') == 2 * n  # the second recording, in both panels
    assert 'data-span="0.0 8.' in section and "Position and following error" not in write(tmp_path, shown)


def test_same_content_gives_same_bytes(tmp_path: Path) -> None:
    assert write(tmp_path, content()) == write(tmp_path, content())


@pytest.mark.parametrize(
    ("verdict", "headline", "states"),
    [
        ("exogenous", "Trust the least-squares model", ["open", "open", "open"]),
        ("endogenous", "Use the instrumental-variable model", ["open", "open", "closed"]),
        ("instruments_invalid", "Do not trust this model", ["closed", "none", "none"]),
        ("not_testable", "Not testable: the log has no position reference", ["none", "none", "none"]),
    ],
)
def test_verdict_and_gates_agree(tmp_path: Path, verdict: Verdict, headline: str, states: list[str]) -> None:
    root = ET.fromstring(write(tmp_path, content(verdict)))
    banner = root.find(".//h2[@id='verdict']")
    assert banner is not None and headline in (banner.text or "")
    items = root.findall(".//ol/li")
    assert [str(item.get("class")).split()[0] for item in items] == [f"gate-{state}" for state in states]


def test_nothing_left_after_the_rank_gate_is_an_exit_and_not_a_refusal(tmp_path: Path) -> None:
    shown = content("exogenous")
    test = shown.identification.test
    for passed in (True, False):
        stopped = (
            test.gates[0],
            replace(test.gates[1], passed=passed),
            replace(test.gates[2], passed=None, statistic=None, p_value=None, columns=()),
        )
        identification = replace(shown.identification, test=replace(test, gates=stopped))
        root = ET.fromstring(write(tmp_path, replace(shown, identification=identification)))
        classes = [str(item.get("class")).split()[0] for item in root.findall(".//ol/li")]
        assert classes == ["gate-open", "gate-exit", "gate-none"]


def test_columns_are_sorted_from_bad_to_good_in_each_gate(tmp_path: Path) -> None:
    shown = content("endogenous")
    for gate in shown.identification.test.gates:
        plot = column_plot(gate)
        assert plot is not None
        sizes = {check.column: check.size for check in gate.columns}
        shares = [sizes[column.name] for _, columns in plot.groups for column in columns]
        assert shares == sorted(sizes.values(), reverse=gate.name != "exogeneity")
        beyond = [column.beyond for _, columns in plot.groups for column in columns]
        assert beyond == sorted(beyond, reverse=True)
    page = ET.fromstring(write(tmp_path, shown))
    words = [cell.text for cell in page.iter("th") if cell.get("class") == "word-row"]
    assert len(words) == 5 and str(words[0]).startswith("● accepted: 50")


@pytest.mark.parametrize(
    ("name", "size", "limit", "text"),
    [
        ("instruments", 2.7e-16, 0.05, "<\u00a00.01\u00a0%"),
        ("instruments", 0.0123, 0.05, "1.23\u00a0%"),
        ("rank", 3e-5, 1e-5, "3.00\u00a0×"),
        ("rank", 3e-20, 1e-5, "<\u00a00.0001\u00a0×"),
        ("rank", 3e-5, 0.0, "∞\u00a0×"),
        ("exogeneity", 0.0, 0.001, "<\u00a00.0001"),
        ("exogeneity", math.nan, 0.001, "–"),
    ],
)
def test_size_of_a_column_in_the_unit_of_its_gate(
    name: GateName, size: float, limit: float, text: str
) -> None:
    check = ColumnCheck("ZZ1", size, limit, None, True)
    plot = column_plot(Gate(name, "", True, None, "", None, None, "", (check,)))
    assert plot is not None
    assert plot.worst.size == text


def test_one_prismatic_axis_without_truth_gates_or_columns(tmp_path: Path) -> None:
    shown = content("not_testable", joints=1, samples=300)
    page = write(tmp_path, replace(shown, robot=robot(1, "prismatic")))
    root = ET.fromstring(page)
    assert len(root.findall(".//figure")) == 1
    figure = root.find(".//figure/div")
    assert figure is not None and "in N," in str(figure.get("aria-label"))


def test_a_third_estimate_has_its_columns_and_its_mark(tmp_path: Path) -> None:
    plain = content("exogenous")
    estimate = plain.identification.least_squares
    first = estimate.parameters[0]
    moved = replace(first, value=first.value + 2.0 * first.sigma)
    third = replace(estimate, method="robust", parameters=(moved, *estimate.parameters[1:]))
    found = write(tmp_path, replace(plain, identification=plain.identification.with_estimates(third)))
    assert "Robust least squares" in found and 'class="third"' in found
    assert "<td>+2.0</td>" in found
    assert 'class="third"' not in write(tmp_path, plain)


def test_closed_loop_pictures_are_added_where_given(tmp_path: Path) -> None:
    shown = content(samples=20_000)
    time = shown.identification.trace.time
    positions = np.sin(time)[:, None] * np.ones(JOINTS)
    page = write(tmp_path, replace(shown, closed_loop=ClosedLoopTrace(time, positions, positions + 1e-4)))
    assert len(ET.fromstring(page).findall(".//figure")) == 2 * JOINTS
    assert len(page.encode()) <= 300_000


def test_folder_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ReportError, match=r"cannot write report .*report\.html: No such file") as raised:
        write_report(tmp_path / "missing" / "report.html", content())
    assert "\n" not in str(raised.value)


def test_a_spike_of_one_sample_survives_reduction() -> None:
    time = np.arange(100_000, dtype=np.float64) * 1e-3
    values = np.zeros(time.size)
    values[54_321] = 9.0
    values[77_777] = math.nan
    kept = extremes(time, values, 300)
    assert 54_321 in kept and 77_777 not in kept
    assert kept[0] == 0 and kept[-1] == time.size - 1
    assert kept.size <= 602 and bool(np.all(np.diff(kept) > 0))


def test_joined_captures_are_laid_end_to_end() -> None:
    time, starts = end_to_end(np.r_[np.linspace(0.0, 0.4, 5), np.linspace(0.0, 0.2, 3)])
    assert starts.tolist() == [5]
    assert np.allclose(np.diff(time), 0.1)


@given(low=st.floats(-1e6, 1e6), span=st.floats(1e-3, 1e6))
def test_ticks_are_few_and_inside(low: float, span: float) -> None:
    ticks = nice_ticks(low, low + span, 4)
    assert 4 <= len(ticks) <= 11
    slack = 1e-6 * span + 1e-9 * abs(low)
    assert all(low - slack <= tick <= low + span + slack for tick in ticks)
