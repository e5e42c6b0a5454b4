"""The demonstration from end to end, over UDP on this machine: results, Ctrl-C, the same seed twice."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.catalogue import models, runs
from daq.catalogue.database import Catalogue
from daq.cli import entry as cli
from daq.cli.demonstration import DemoRequest, DemoResult, run_demo
from daq.files.model_file import read_model
from daq.keeping.again import rerun
from daq.recording.capture import Capture
from daq.recording.reader import read_capture
from daq.text.progress import Silent
from drivers import BusOccupied, Channel, StreamResult, open_bus
from drivers.cia402.states import State, has_torque, state_of
from drivers.simulated import SimulatedArm
from robots import Robot
from tests.daq.captures import samples_in

SHORT = ["--duration", "5", "--periods", "1", "--evaluations", "600"]
VERDICTS = {"exogenous", "endogenous", "instruments_invalid", "not_testable"}


def sockets_on(group: str, port: int) -> list[str]:
    """Lines of the system's list of UDP sockets that are bound to a group and port.

    The port alone is not enough: the workers of one run of the suite share it, each with groups of its own.
    """
    address = int.from_bytes(socket.inet_aton(group), sys.byteorder)
    table = Path("/proc/net/udp").read_text().splitlines()[1:]
    return [line for line in table if line.split()[1] == f"{address:08X}:{port:04X}"]


def assert_nothing_left(channel: Channel) -> None:
    """No socket on the channel and no lock file of it."""
    group, port = channel.group_and_port()
    assert not sockets_on(group, port)
    assert not list(Path(os.environ["ARMHIL_STATE"]).glob(f"*{group}*{port}*.lock"))


def assert_json_conforms(result: dict[str, Any], robot: Robot) -> None:
    """The keys that others script against."""
    assert result["robot"] == robot.name
    assert len(result["captures"]) == 1 and result["rows"] > 0
    names = result["base_parameters"]
    assert set(result["truth"]) == set(names)
    for method in ("ls", "iv"):
        estimate = result["estimates"][method]
        assert [parameter["name"] for parameter in estimate["parameters"]] == names
        assert set(estimate["parameters"][0]) >= {"name", "value", "sigma", "percent_sigma", "unit"}
        assert estimate["condition"] > 1
        assert estimate["relative_error_percent"]["total"] > 0
        for key in ("torque_rms", "lag1_autocorrelation"):
            assert len(estimate[key]) == robot.n
        assert len(estimate["relative_error_percent"]["per_joint"]) == robot.n
    test = result["test"]
    assert test["verdict"] in VERDICTS and test["recommendation"]
    assert [gate["name"] for gate in test["gates"]] == ["instruments", "rank", "exogeneity"]
    assert set(test["gates"][0]) >= {"passed", "statistic", "df", "p_value", "detail"}


def test_from_a_trajectory_to_a_verdict(
    tx40: Robot,
    channel: Channel,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    no_leftovers: None,
) -> None:
    out = tmp_path / "run"
    arguments = ["demo", "--seed", "5", "--channel", channel.name, "--out", str(out), "--json", *SHORT]
    monkeypatch.setattr(sys, "argv", ["armhil", *arguments])
    with pytest.raises(SystemExit) as leaving:
        cli.main()
    printed = capsys.readouterr()
    assert leaving.value.code in {0, 1}, printed.err
    assert_nothing_left(channel)

    result = json.loads(printed.out)
    assert_json_conforms(result, tx40)
    assert (leaving.value.code == 1) == (result["test"]["verdict"] == "instruments_invalid")
    assert result == json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert {path.name for path in out.iterdir()} == {
        "capture.live",
        "capture.mcap",
        "report.html",
        "result.json",
        "truth.json",
        "tx40.model.toml",
    }

    # A report that is whole, and the answer on the terminal with where to find it.
    report = (out / "report.html").read_text(encoding="utf-8")
    assert report.rstrip().endswith("</html>") and 'src="http' not in report
    assert str(out / "report.html") in printed.err
    if result["test"]["verdict"] in {"exogenous", "endogenous"}:
        assert f"use {out / 'tx40.model.toml'}" in printed.err
    assert "Beside the true parameters of the simulated arm" in printed.err

    # The estimates against the truth: friction, and the standard deviations that go with them.
    chosen = "iv" if result["test"]["verdict"] == "endogenous" else "ls"
    estimates = {p["name"]: p for p in result["estimates"][chosen]["parameters"]}
    truth = result["truth"]
    friction = [name for name in truth if name.startswith(("Fv", "Fc")) and truth[name] > 0.1]
    assert len(friction) >= 11
    for name in friction:
        assert estimates[name]["value"] == pytest.approx(truth[name], rel=0.05), name
    away = [(estimates[name]["value"] - truth[name]) / estimates[name]["sigma"] for name in truth]
    assert np.sqrt(np.mean(np.square(away))) < 2.5
    assert np.abs(away).max() < 6

    # The capture has every cycle, and says how it came to be.
    capture = read_capture(out / "capture.mcap")
    assert not capture.damage
    assert capture.outcome is not None and capture.outcome["outcome"] == "completed"
    assert int(capture.outcome["cycles"]) == len(capture.samples)
    assert len(capture.samples) * capture.period == pytest.approx(5.0, rel=0.5)
    assert (capture.run["seed"], capture.run["kind"]) == ("5", "simulated")
    assert capture.run["channel"] == str(channel)
    assert len(json.loads(capture.run["drives"])) == 6

    # The catalogue has the run and its model, and the same comes out again.
    with Catalogue() as catalogue:
        (run,) = runs.every(catalogue)
        assert (run.kind, run.arm, run.outcome) == ("demo", "tx40-sim", "completed")
        assert (run.capture, run.capture_sha256) == (str(out / "capture.mcap"), capture.sha256)
        (kept,) = models.of_run(catalogue, run.id)
        assert kept.verdict == result["test"]["verdict"] and kept.report == str(out / "report.html")
        again = rerun(catalogue, run.id, Silent())
    assert (again.sameness, again.remarks) == ("identical", ())

    # The model file holds what the verdict recommends.
    model = read_model(out / "tx40.model.toml")
    assert model.estimate.estimator == chosen
    assert model.estimate.verdict == result["test"]["verdict"]
    assert {p.name: p.value for p in model.parameter} == {n: p["value"] for n, p in estimates.items()}
    assert model.capture[0].sha256 == capture.sha256


def start_demo(out: Path, channel: Channel) -> subprocess.Popen[str]:
    """A long demonstration, in a process group of its own as a terminal would have it."""
    options = ["--duration", "20", "--periods", "2", "--evaluations", "100"]
    return subprocess.Popen(
        [sys.executable, "-m", "daq", "demo", "--channel", channel.name, "--out", str(out), *options],
        env={**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[2])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for_motion(process: subprocess.Popen[str], path: Path) -> None:
    """Until the capture holds samples: frames are there before, samples only while streaming."""
    deadline = time.monotonic() + 120.0
    while not (path.exists() and samples_in(path)):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.slow
def test_ctrl_c_while_the_arm_moves(
    tx40: Robot, channel: Channel, tmp_path: Path, no_leftovers: None
) -> None:
    path = tmp_path / "capture.mcap"
    process = start_demo(tmp_path, channel)
    statuswords = dict.fromkeys((0x180 + drive.node_id for drive in tx40.drive), 0)
    try:
        wait_for_motion(process, path)
        with open_bus(channel, statuswords) as witness:
            os.killpg(process.pid, signal.SIGINT)
            # TPDOs are read past the command: do the drives themselves say that torque is off?
            while (message := witness.recv(1.0)) is not None or process.poll() is None:
                if message is not None:
                    statuswords[message.arbitration_id] = int.from_bytes(message.data[:2], "little")
        out, err = process.communicate(timeout=60)
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
    assert process.returncode == 130, err
    assert {state_of(word) for word in statuswords.values()} == {State.SWITCH_ON_DISABLED}
    assert "Traceback" not in out + err
    assert_nothing_left(channel)

    capture = read_capture(path)
    assert capture.outcome is not None
    assert (capture.outcome["outcome"], capture.outcome["reason"]) == ("stopped", "Ctrl-C")
    assert not capture.damage
    (line,) = err.splitlines()
    # A busy machine may miss deadlines, which is said.
    missed = int(capture.outcome["missed_cycles"])
    kept = StreamResult("stopped", "Ctrl-C", len(capture.samples), missed, 0).cycles_words
    assert line == (
        f"armhil: stopped (Ctrl-C): the arm is at rest and its torque is off; {kept} kept in {path}"
    )
    assert_ramped_down(tx40, capture)


def assert_ramped_down(robot: Robot, capture: Capture) -> None:
    """The record ends at rest, reached within the acceleration limits, with the drives in control."""
    samples, period = capture.samples, capture.period
    velocity = np.diff(samples.reference, axis=0) / period
    acceleration = np.diff(velocity, axis=0) / period
    # Targets are whole counts; through the coupled wrist, two at a joint.
    count = 4 / np.abs(robot.counts_per_output_unit).min() / period**2
    assert np.abs(velocity).max() > 0.1, "it moved"
    assert np.abs(velocity[-1]).max() == 0.0, "it was stopped"
    assert np.all(np.abs(acceleration) <= robot.acceleration_limits * 1.001 + count)
    # The arm itself follows its set-points by a few periods, and has torque until it stands.
    measured = np.diff(samples.position, axis=0) / period
    assert np.all(np.abs(measured[-1]) <= 10 * robot.acceleration_limits * period)
    assert all(has_torque(int(word)) for word in samples.statusword[-1])


def whole_run(robot: Robot, channel: Channel, folder: Path) -> DemoResult:
    folder.mkdir()
    return run_demo(DemoRequest(robot, robot.name, channel, 8, folder, 5.0, 1, 100), Silent())


@pytest.mark.slow
def test_the_same_seed_gives_the_same_samples_and_the_same_truth(
    tx40: Robot, channel: Channel, tmp_path: Path, no_leftovers: None
) -> None:
    """A late SYNC changes nothing: the simulated arm goes by SYNCs. Where a drive answered too late, its
    values are no sample. That the results are the same too is shown in virtual time (test_demo_vcan.py)."""
    one, other = (whole_run(tx40, channel, tmp_path / name) for name in ("first", "second"))
    assert one.truth == other.truth
    first, second = one.capture.samples, other.capture.samples
    for column in ("cycle", "time", "reference"):
        np.testing.assert_array_equal(getattr(first, column), getattr(second, column), column)
    answered = first.complete & second.complete
    assert answered.mean() > 0.9
    for column in ("position", "control_signal", "statusword"):
        np.testing.assert_array_equal(
            getattr(first, column)[answered], getattr(second, column)[answered], column
        )


@pytest.mark.slow
def test_a_second_demo_takes_the_next_free_group(emps: Robot, channel: Channel, tmp_path: Path) -> None:
    """The first one's drives hold the group; with a channel that was named it is refused instead.

    And the arm hides what it was told to.
    """
    hidden = tmp_path / "hidden.toml"
    hidden.write_text("format = 1\n[[viscous_friction]]\ndrive = 1\nchange = 0.5\n", encoding="utf-8")
    request = DemoRequest(emps, "emps", channel, 1, tmp_path, 5.0, 1, 200, any_group=True, scenario=hidden)
    with SimulatedArm("emps", channel, 1):
        with pytest.raises(BusOccupied, match="is occupied"):
            run_demo(replace(request, any_group=False), Silent())
        with Catalogue() as catalogue:
            result = run_demo(replace(request, catalogue=catalogue), Silent())
    assert result.capture.run["channel"] == str(channel.beside(1))
    estimate = {p.name: p.value for p in result.fitted.result.estimates[0].parameters}
    assert estimate["Fv1"] == pytest.approx(1.5 * result.truth["Fv1"], rel=0.1)
    assert result.run is not None
