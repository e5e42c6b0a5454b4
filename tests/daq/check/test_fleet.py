"""Eight simulated arms: the same verdicts and numbers one at a time, at once, and through dask.

A stream takes its time on a clock, so what is the same here is what follows from it: the same captures give
the same models, comparisons and verdicts bit for bit. ``benchmarks/fleet.py`` streams eight arms over buses.
"""

from __future__ import annotations

import os
import pickle
import re
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from daq.catalogue import arms, baselines, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import CatalogueError
from daq.check import analysis
from daq.check import check as check_module
from daq.check.analysis import AnalysisOrder, analyse
from daq.check.errors import CheckError
from daq.check.fleet import Fleet, FleetArm
from daq.check.fleet_run import FleetChecked, check_fleet
from daq.check.judged import comparison_json
from daq.check.recorded import Recorded
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.check.terminal import print_fleet
from daq.cli import entry
from daq.cli.check import tell_of
from daq.notify import notify as notify_module
from drivers import Channel
from ident import Fitted, IdentificationError
from ident.drift import DriftSettings
from robots import Robot
from robots.errors import RobotFileError
from tests.daq.check.offline_arms import record_offline, write_motion

ARMS = 8
FAULTY = 5
LOST_GAIN = "[[drive_gain_error]]\ndrive = 1\nchange = -0.2\n"


def fleet_of(motion: Path, scenario: Path | None = None) -> Fleet:
    listed = tuple(
        FleetArm(
            robot="emps",
            interface="udp_multicast",
            channel=f"239.74.0.{k + 1}:19999",
            simulated=True,
            seed=k,
            trajectory=str(motion),
            scenario=str(scenario) if scenario is not None and k == FAULTY else None,
        )
        for k in range(ARMS)
    )
    return Fleet(format=1, arm=listed)


def two_nights(folder: Path, motion: Path, backend: str, at_once: int) -> FleetChecked:
    """A first night that is accepted, and a second one on which one arm has lost a fifth of its gain."""
    folder.mkdir()
    scenario = folder / "scenario.toml"
    scenario.write_text(f"format = 1\n{LOST_GAIN}")
    with Catalogue(str(folder / "catalogue.db")) as catalogue:

        def night(fleet: Fleet, name: str, backend: str, at_once: int) -> FleetChecked:
            return check_fleet(
                fleet,
                catalogue,
                folder / name,
                DriftSettings(),
                None,
                at_once=at_once,
                jobs=2,
                backend=backend,
            )

        first = night(fleet_of(motion), "first", "sequential", 1)
        assert [one.verdict for one in first.results] == [Verdict.UNKNOWN] * ARMS, first.outcomes
        for result in first.results:
            baselines.accept(catalogue, result.model, "Ada", "first night", None)
        second = night(fleet_of(motion, scenario), "second", backend, at_once)
        assert len(arms.every(catalogue)) == ARMS and len(runs.every(catalogue)) == 2 * ARMS
        assert {run.state for run in runs.every(catalogue)} == {"finished"}
    return second


def require_same(found: FleetChecked, alone: FleetChecked) -> None:
    for one, other in zip(found.results, alone.results, strict=True):
        for estimate, again in zip(one.fitted.result.estimates, other.fitted.result.estimates, strict=True):
            np.testing.assert_array_equal(estimate.values, again.values)
            np.testing.assert_array_equal(estimate.covariance, again.covariance)
        assert one.verdict is other.verdict
        assert unnumbered(one.sentence) == unnumbered(other.sentence)
        assert one.comparison is not None and other.comparison is not None
        assert unnumbered(comparison_json(one.comparison)) == unnumbered(comparison_json(other.comparison))


def unnumbered(value: Any) -> Any:
    """A result without the numbers of runs and the days they were made, which differ between two fleets."""
    if isinstance(value, dict):
        return {key: unnumbered(entry) for key, entry in value.items() if key != "day"}
    if isinstance(value, list | tuple):
        return [unnumbered(entry) for entry in value]
    return re.sub(r"\brun \d+", "run", value) if isinstance(value, str) else value


@pytest.mark.slow
def test_eight_arms_at_once_and_one_at_a_time(
    emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_leftovers: None
) -> None:
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)
    alone = two_nights(tmp_path / "alone", motion, "sequential", 1)
    verdicts = [one.verdict for one in alone.results]
    assert verdicts[FAULTY] is Verdict.FAILED and verdicts.count(Verdict.OK) == ARMS - 1
    assert "drive gain of joint 1 -2" in alone.results[FAULTY].sentence
    assert len({tuple(one.fitted.least_squares.beta) for one in alone.results}) == ARMS

    require_same(two_nights(tmp_path / "processes", motion, "loky", ARMS), alone)
    pytest.importorskip("distributed")
    require_same(two_nights(tmp_path / "dask", motion, "dask", ARMS), alone)


def test_a_backend_that_nobody_knows_is_refused_before_anything_moves(tmp_path: Path) -> None:
    with (
        Catalogue() as catalogue,
        pytest.raises(CheckError, match=r"--backend clouds: joblib does not know it; allowed: dask, loky"),
    ):
        check_fleet(
            fleet_of(tmp_path / "none"),
            catalogue,
            tmp_path,
            DriftSettings(),
            None,
            at_once=1,
            jobs=1,
            backend="clouds",
        )
    assert not list(tmp_path.glob("**/*.mcap"))


@pytest.mark.slow
def test_over_buses_one_that_fails_does_not_stop_the_others(
    new_channel: Callable[[], Channel], tmp_path: Path, no_leftovers: None
) -> None:
    """Two arms stream at the same time on buses of their own, beside one that cannot be had."""
    channels = [new_channel() for _ in range(2)]
    listed = [
        FleetArm(robot="emps", interface=c.interface, channel=c.name, simulated=True, seed=k)
        for k, c in enumerate(channels)
    ]
    broken = FleetArm(robot="emps", interface="virtual", channel="nowhere", simulated=True)
    with Catalogue() as catalogue:
        done = check_fleet(
            Fleet(format=1, arm=(*listed, broken)),
            catalogue,
            tmp_path,
            DriftSettings(),
            None,
            at_once=2,
            jobs=2,
            backend="loky",
            duration=4.0,
            evaluations=300,
        )
    assert [isinstance(one, CheckResult) for one in done.outcomes] == [True, True, False], done.outcomes
    assert done.exit_code == 2 and "lives inside one process" in str(done.outcomes[-1])
    assert len({result.arm for result in done.results}) == 2
    again = [analyse(AnalysisOrder("emps", result.capture)) for result in done.results]
    for result, fitted in zip(done.results, again, strict=True):
        np.testing.assert_array_equal(result.fitted.least_squares.beta, fitted.least_squares.beta)


def test_what_is_wrong_with_one_arm_does_not_stop_the_others(
    emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An identification that fails, a broken description, a cell that is not there, a damaged model."""
    monkeypatch.setattr(check_module, "record_check", record_offline)
    whole = analysis.analyse

    def failing(order: AnalysisOrder) -> Fitted:
        if "02-" in str(order.capture):
            raise IdentificationError("made up")
        return whole(order)

    monkeypatch.setattr(analysis, "analyse", failing)
    motion = write_motion(emps, tmp_path, 2.5)
    (tmp_path / "robot.toml").write_text("format = 1\nname = 7\n")
    good = fleet_of(motion).arm[:3]
    broken = good[0].model_copy(update={"robot": str(tmp_path / "robot.toml"), "channel": "239.74.0.9:19999"})
    walled = good[0].model_copy(update={"cell": str(tmp_path / "none.toml"), "channel": "239.74.0.10:19999"})

    def night(catalogue: Catalogue, name: str, *listed: FleetArm) -> FleetChecked:
        fleet = Fleet(format=1, arm=listed)
        return check_fleet(
            fleet,
            catalogue,
            tmp_path / name,
            DriftSettings(),
            None,
            at_once=1,
            jobs=1,
            backend="sequential",
        )

    with Catalogue() as catalogue:
        done = night(catalogue, "first", *good, broken, walled)
        assert [isinstance(one, CheckResult) for one in done.outcomes] == [True, False, True, False, False]
        assert str(done.outcomes[1]) == "made up" and done.exit_code == 2
        assert "robot.toml" in str(done.outcomes[3]) and "none.toml" in str(done.outcomes[4])
        assert done.names[3] == f"{tmp_path / 'robot.toml'} on udp_multicast 239.74.0.9:19999, simulated"
        assert [one.get("error", "")[:7] for one in done.as_json()["arms"]][:2] == ["", "made up"]
        for result in done.results:
            baselines.accept(catalogue, result.model, "Ada", "first night", None)
        with catalogue.writing() as connection:
            model = done.results[0].model
            connection.exec_driver_sql(f"UPDATE models SET found = '[7' WHERE id = {model}")
        monkeypatch.setattr(analysis, "analyse", whole)
        second = night(catalogue, "second", good[0], good[2])
        assert isinstance(second.outcomes[0], CatalogueError) and isinstance(second.outcomes[1], CheckResult)
        assert "the file is damaged" in str(second.outcomes[0])
        assert second.outcomes[1].verdict is Verdict.OK


def test_a_mistake_of_our_own_ends_no_other_arms_night(
    emps: Robot,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Whatever is raised for one arm, and wherever: its line says so, with a code; the log has a trace."""
    whole_analysis, whole_judging, kelvins = analysis.analyse, check_module.judge_check, [1.0]

    def recorded(request: CheckRequest, *others: Any) -> Recorded:
        if "01-" in str(request.folder):
            raise IndexError(kelvins[7])
        return record_offline(request, *others)

    def analysed(order: AnalysisOrder) -> Fitted:
        if "02-" in str(order.capture):
            raise ZeroDivisionError("float division\nby zero")
        return whole_analysis(order)

    def judged(request: CheckRequest, *others: Any) -> CheckResult:
        if "03-" in str(request.folder):
            raise AttributeError("'NoneType' object has no attribute 'state'")
        return whole_judging(request, *others)

    monkeypatch.setattr(check_module, "record_check", recorded)
    monkeypatch.setattr(analysis, "analyse", analysed)
    monkeypatch.setattr(check_module, "judge_check", judged)
    fleet = Fleet(format=1, arm=fleet_of(write_motion(emps, tmp_path, 2.5)).arm[:4])
    with Catalogue() as catalogue:
        done = check_fleet(
            fleet,
            catalogue,
            tmp_path / "night",
            DriftSettings(),
            None,
            at_once=1,
            jobs=1,
            backend="sequential",
        )
    assert done.exit_code == 2
    assert [isinstance(one, CheckResult) for one in done.outcomes] == [False, False, False, True]
    words = [str(one) for one in done.outcomes[:3]]
    for said, kind in zip(words, ("IndexError", "ZeroDivisionError", "AttributeError"), strict=True):
        assert said.startswith(f"{kind}: ") and "a mistake of armhil's own" in said and "\n" not in said
    traces = [entry.exc_info for entry in caplog.records if "a mistake of armhil's own" in entry.message]
    assert len(traces) == 3 and all(traces)

    (fine,) = done.results
    shown = StringIO()
    print_fleet(Console(file=shown, width=400), done)
    lines = shown.getvalue().splitlines()
    assert [line.split(" - ")[0] for line in lines[:4]] == ["ARMHIL FAILED"] * 3 + ["ARMHIL UNKNOWN"]
    assert lines[4:] == [f"Report: {fine.report}"] and fine.report.is_file()
    shown.truncate(0)
    print_fleet(Console(file=shown, width=400), FleetChecked(("x",), (replace(fine, verdict=Verdict.OK),)))
    assert "Report" not in shown.getvalue()  # a fleet of two hundred that is fine is two hundred lines

    def none(result: CheckResult, *others: Any) -> None:
        raise BlockingIOError("no process can be started")

    monkeypatch.setattr(notify_module, "notify_of", none)
    with Catalogue() as catalogue:
        tell_of([fine, replace(fine, arm="other")], catalogue, None)
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if "WARNING" in line] == [
        f"armhil: WARNING: {arm}: nobody was told: no process can be started" for arm in (fine.arm, "other")
    ]


def test_an_error_comes_out_of_another_process_as_it_was() -> None:
    """One whose ``__init__`` asks for more than its text would end the process that takes it over."""
    error = RobotFileError("robot.toml", "is none", line=3, key="name", allowed="a name")
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is RobotFileError and str(again) == str(error) and vars(again) == vars(error)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--all", "--cell", str(Path(__file__))), "--cell: not with --all; fleet.toml says it for each arm"),
        (("emps", "--jobs", "3"), "--jobs: only with --all"),
    ],
)
def test_options_that_would_be_ignored_are_refused(
    words: tuple[str, ...], said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["armhil", "check", *words])
    with pytest.raises(SystemExit) as ended:
        entry.main()
    assert ended.value.code == 2 and said in capsys.readouterr().err


FATAL = "fatal.mcap"
"""Whoever is given it dies, as by the kernel's out-of-memory killer."""


def deadly(order: AnalysisOrder) -> Path:
    """In place of an identification, in a process of joblib's."""
    if order.capture.name == FATAL:
        os.kill(os.getpid(), signal.SIGKILL)
    return order.capture


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_a_process_that_dies_takes_its_own_arm_along_and_no_other(
    backend: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, no_leftovers: None
) -> None:
    monkeypatch.setattr(analysis, "tried", deadly)
    captures = [Path(name) for name in ("a", FATAL, "b")]
    first, died, last = analysis.analyse_all([AnalysisOrder("emps", c) for c in captures], backend, 2)
    assert (first, last) == (captures[0], captures[2])
    assert isinstance(died, CheckError)
    assert f"{FATAL}: the process that identified it has died, twice" in str(died)
    assert "is done one by one" in caplog.text
