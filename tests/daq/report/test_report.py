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
from daq.text.numbers import percent, probability, significant, with_sigma
from ident.effects.family import Place, StandardParameter
from ident.results import Estimate, Identification, Parameter, TorqueTrace
from ident.verdicts import ColumnCheck, Gate, GateName, RevisedTest, Verdict
from robots.description import Robot

JOINTS = 6
INJECTION = "<script>alert('a & b')</script>\"><img src=x onerror=alert(1)>"
LONG_NAME = "ZZ3R_with_a_name_that_somebody_imported_from_a_very_long_column_heading"
VOID = {"meta", "img", "br", "link", "input", "hr"}


def robot(joints: int, kind: str = "revolute") -> Robot:
    axis = {
        "name": "axis",
        "kind": kind,
        "position": (-3.0, 3.0),
        "velocity": 5.0,
        "acceleration": 20.0,
        "jerk": 400.0,
        "torque": 200.0,
    }
    drive = {
        "encoder_counts": 4096,
        "gear": 32.0,
        "control_signal": {"per_count": 0.001},
        "gain": 35.0,
        "gain_relative_uncertainty": 0.02,
        "dynamics": {"inertia": 0.3, "viscous": 8.0, "coulomb": 7.0},
    }
    ones = (1.0,) * joints
    return Robot.model_validate(
        {
            "format": 1,
            "name": "bench",
            "description": "six axes " + INJECTION,
            "urdf": "bench.urdf",
            "home": (0.0,) * joints,
            "joint": tuple(axis | {"name": f"axis_{j + 1}"} for j in range(joints)),
            "drive": tuple(drive | {"node_id": j + 1} for j in range(joints)),
            "transmission": tuple(tuple(float(i == j) for j in range(joints)) for i in range(joints)),
            "controller": {
                "type": "cascade_p_pi",
                "sample_time": 0.001,
                "position_gain": ones,
                "velocity_gain": ones,
                "integral_gain": ones,
                "velocity_feed_forward": ones,
                "saturation": ones,
            },
            "identification": {"cutoff_hz": 50.0, "decimation": 10},
        }
    )


def names(joints: int) -> list[str]:
    kinds = ("ZZ", "XX", "XY", "XZ", "YZ", "MX", "MY", "Fv", "Fc")
    found = [f"{kind}{j + 1}R" for j in range(joints) for kind in kinds]
    found[4] = LONG_NAME
    found[7] = f"Fv1{INJECTION}"
    return found[:50]


def estimate(method: str, joints: int, seed: int) -> Estimate:
    random = np.random.default_rng(seed)
    parameters = []
    for k, name in enumerate(names(joints)):
        value = float(random.normal() * 10.0 ** random.integers(-3, 2))
        sigma = abs(value) * float(random.uniform(0.002, 0.3)) + 1e-5
        expression = f"{name} + Ia{k} - 0.225·d4²·M{k} + " + " + ".join(f"YY{i}" for i in range(k % 9))
        leading = StandardParameter("ZZ", Place("joint", (k // 9,)), "rigid_body", "kg·m²")
        parameters.append(Parameter(name, value, sigma, "kg·m²", expression, leading))
    parameters[2] = replace(parameters[2], value=0.0, sigma=0.02)
    parameters[3] = replace(parameters[3], value=math.nan, sigma=math.nan)
    parameters[5] = replace(parameters[5], sigma=math.inf)
    parameters[6] = replace(parameters[6], sigma=0.0)
    return Estimate(
        method="iv" if method == "iv" else "ls",
        parameters=tuple(parameters),
        covariance=np.eye(len(parameters)),
        covariance_kind="AR-prewhitened",
        condition=142.3,
        relative_error_percent=7.334,
        relative_error_percent_per_joint=random.uniform(3, 12, joints),
        torque_rms=random.uniform(0.2, 3, joints),
        lag1_autocorrelation=random.uniform(0, 0.9, joints),
        iterations=3,
    )


def gates(verdict: Verdict, joints: int) -> tuple[Gate, ...]:
    random = np.random.default_rng(5)
    reached = {"exogenous": 3, "endogenous": 3, "instruments_invalid": 1, "not_testable": 0}[verdict]
    outcome = [verdict != "instruments_invalid", True, verdict == "exogenous"]

    def columns(low: float, high: float, limit: float, small_is_bad: bool = False) -> tuple[ColumnCheck, ...]:
        sizes = 10 ** random.uniform(np.log10(low), np.log10(high), len(names(joints)))
        return tuple(
            ColumnCheck(name, float(size), limit, None, bool((size <= limit) != small_is_bad))
            for name, size in zip(names(joints), sizes, strict=True)
        )

    departures = columns(0.002, 0.3 if verdict == "instruments_invalid" else 0.045, 0.05)
    first = tuple(replace(check, p_value=0.04) for check in departures)
    made: tuple[tuple[GateName, str, str, tuple[ColumnCheck, ...]], ...] = (
        ("instruments", "Π = I: every instrument is the regressor without its noise", "F", first),
        (
            "rank",
            "V̂ = 0: nothing is left of the regressors beside the instruments",
            "rank",
            columns(1e-6, 1, 1e-3),
        ),
        (
            "exogeneity",
            "γ = 0: the torque error does not depend on V̂",
            "F",
            columns(1e-9, 1, 0.001, small_is_bad=True),
        ),
    )
    return tuple(
        Gate(
            name=name,
            null=null,
            passed=outcome[k] if k < reached else None,
            statistic=1.37 if k < reached and name != "rank" else None,
            distribution=distribution,
            df=(48.0, 5294.0) if k < reached else None,
            p_value=(0.043, None, 2e-9)[k] if k < reached else None,
            detail="The largest departure would move no parameter by more than 0.4 σ." if k < reached else "",
            columns=checks if k < reached else (),
        )
        for k, (name, null, distribution, checks) in enumerate(made)
    )


def content(verdict: Verdict = "exogenous", joints: int = JOINTS, samples: int = 6000) -> ReportContent:
    random = np.random.default_rng(1)
    time = np.arange(samples, dtype=np.float64) * 0.01
    frequency = random.uniform(0.1, 0.6, joints)
    measured = 40 * np.sin(2 * np.pi * time[:, None] * frequency) * random.uniform(0.1, 2, joints)
    measured = measured + 6 * np.sign(np.cos(2 * np.pi * time[:, None] * frequency))
    predicted = measured + random.normal(0, 1, (samples, joints))
    least_squares = estimate("ls", joints, 2)
    testable = verdict != "not_testable"
    instrumental = None
    if testable:
        moved = [
            replace(p, value=p.value + 0.8 * p.sigma * float(random.normal()), sigma=1.2 * p.sigma)
            for p in least_squares.parameters
        ]
        instrumental = replace(least_squares, method="iv", parameters=tuple(moved))
    truth = {p.name: p.value + p.sigma * float(random.normal()) for p in least_squares.parameters}
    textbook = replace(gates("endogenous", joints)[2], columns=(), detail="i.i.d. errors.")
    return ReportContent(
        title=f"bench: identification {INJECTION}",
        robot=robot(joints),
        joint_names=tuple(f"axis_{j + 1}" for j in range(joints)),
        identification=Identification(
            robot="bench",
            rows=samples * joints,
            by_estimator={e.method: e for e in (least_squares, instrumental) if e is not None},
            instrumental_reason="" if testable else "the log has no position reference",
            test=RevisedTest(
                verdict=verdict,
                recommendation=f"Use the model for feed-forward & simulation. {INJECTION}",
                covariance="AR(2) per joint, prewhitened",
                gates=gates(verdict, joints),
            ),
            textbook=textbook if testable else None,
            trace=TorqueTrace(time, measured, predicted),
            warnings=("joint 4 stands still for 22 % of the record", INJECTION),
        ),
        truth=truth if testable else None,
        facts={"Seed": "7", "Cycle time": "4 ms", "Missed cycles": "0", "Capture": INJECTION},
    )


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


@pytest.mark.parametrize(
    ("value", "sigma", "texts"),
    [
        (95.1089, 0.1085, ("95.11", "0.11")),
        (-3.1648, 0.0444, ("−3.165", "0.044")),
        (1234.5, 321.0, ("1230", "320")),
        (9.996, 0.0996, ("10.00", "0.10")),
        (3.21e-7, 4.4e-9, ("3.210·10⁻⁷", "0.044·10⁻⁷")),
        (-0.0001, 0.2, ("0.00", "0.20")),
        (math.nan, math.nan, ("–", "–")),
        (2.0, math.inf, ("2.000", "∞")),
        (95.1089, 0.0, ("95.11", "0")),
    ],
)
def test_sigma_sets_the_digits(value: float, sigma: float, texts: tuple[str, str]) -> None:
    assert with_sigma(value, sigma) == texts


@given(
    value=st.floats(-1e9, 1e9),
    sigma=st.floats(1e-12, 1e9),
)
def test_rounding_never_moves_a_value_by_more_than_a_share_of_sigma(value: float, sigma: float) -> None:
    shown = with_sigma(value, sigma)[0].replace("−", "-")
    superscript = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    mantissa, _, power = shown.partition("·10")
    number = float(mantissa) * 10.0 ** (int(power.translate(superscript)) if power else 0)
    assert abs(number - value) <= 0.051 * sigma + 1e-9 * abs(value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (significant(0.00012345), "0.000123"),
        (significant(1.2e-9), "1.20·10⁻⁹"),
        (significant(5294.0, 4), "5294"),
        (significant(None), "–"),
        (percent(4.0834), "4.08\u00a0%"),
        (percent(math.inf), "∞"),
        (percent(512.3), "512\u00a0%"),
        (probability(3e-12), "p < 0.0001"),
        (probability(0.0431), "p = 0.043"),
    ],
)
def test_number_texts(text: str, expected: str) -> None:
    assert text == expected


@given(low=st.floats(-1e6, 1e6), span=st.floats(1e-3, 1e6))
def test_ticks_are_few_and_inside(low: float, span: float) -> None:
    ticks = nice_ticks(low, low + span, 4)
    assert 4 <= len(ticks) <= 11
    slack = 1e-6 * span + 1e-9 * abs(low)
    assert all(low - slack <= tick <= low + span + slack for tick in ticks)
