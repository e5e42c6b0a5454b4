"""``armhil identify``: on a small capture made without a bus, and on the published recordings."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest

from daq.files.model_file import read_model
from daq.recording.capture import Capture
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from ident import RegressorModel, base_parameters
from ident.estimators import METHODS
from ident.parameters.base import random_states
from robots import Robot
from robots.standard import link_parameter_names
from tests.daq.calls import Call
from tests.daq.captures import facts, outcome

SECONDS = 4.0
Identify = Callable[..., dict[str, Any]]


@pytest.fixture
def identify(armhil: Call) -> Identify:
    """Calls ``armhil identify … --json`` in this process and returns the object that it printed."""

    def call(*arguments: object) -> dict[str, Any]:
        code, out, err = armhil("identify", *arguments, "--json")
        assert code in {0, 1}, err
        result: dict[str, Any] = json.loads(out)
        # A model that must not be trusted is a warning.
        assert (code == 1) == (result["test"]["verdict"] == "instruments_invalid")
        return result | {"stderr": err}

    return call


def back_and_forth(robot: Robot) -> np.ndarray:
    """Three sines for the one axis, from rest to rest within its limits, N × 1."""
    t = np.arange(0.0, SECONDS, robot.bus.cycle_time)
    window = np.minimum(1.0, np.minimum(t, SECONDS - t)) ** 2
    sines = sum(a * np.sin(2 * np.pi * f * t) for a, f in ((0.03, 0.5), (0.01, 1.3), (0.004, 2.9)))
    return np.asarray(window * sines)[:, np.newaxis]


@pytest.fixture(scope="module")
def capture(emps: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A capture of the simulated one-axis arm, seed 2."""
    path = tmp_path_factory.mktemp("offline") / "capture.mcap"
    run = simulate_offline(emps, draw_truth(emps, 2), back_and_forth(emps))
    with Recorder(path, emps, facts(emps, emps.bus.cycle_time)) as recorder:
        recorder.write(run.samples())
        recorder.finish(outcome(len(run.cycle)))
    return path


def values(result: dict[str, Any], method: str = "ls", key: str = "value") -> dict[str, float]:
    return {p["name"]: p[key] for p in result["estimates"][method]["parameters"]}


def without_words(result: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in result.items() if key != "stderr"}


def test_a_capture_knows_its_arm_and_gives_it_back(
    identify: Identify, capture: Path, emps: Robot, tmp_path: Path
) -> None:
    result = identify(capture)
    assert (result["robot"], result["captures"]) == ("emps", [str(capture)])
    assert without_words(identify(capture, "--robot", "emps")) == without_words(result)

    # What it says is true, once it is told that simulated drives hold their signal after the sample.
    shutil.copytree(emps.folder, tmp_path / "emps")
    text = emps.source_text.replace("trim_samples =", "control_signal_lag = 0.0005\ntrim_samples =")
    (tmp_path / "emps" / "robot.toml").write_text(text, encoding="utf-8")
    result = identify(capture, "--robot", tmp_path / "emps")
    truth = draw_truth(emps, 2).parameters
    found = values(result, "iv" if result["test"]["verdict"] == "endogenous" else "ls")
    assert found["Fv1"] == pytest.approx(truth["Fv1"], rel=0.05)
    assert found["Fc1"] == pytest.approx(truth["Fc1"], rel=0.05)
    assert found["M1R"] == pytest.approx(truth["M1"] + truth["Ia1"], rel=0.05)
    assert len(result["test"]["gates"]) == 3


def test_settings_of_the_call_take_the_place_of_the_arms(identify: Identify, capture: Path) -> None:
    plain, changed = identify(capture), identify(capture, "--cutoff", 40, "--rate", 50)
    assert changed["rows"] == pytest.approx(plain["rows"] / 2, abs=3)
    assert values(changed) != values(plain)
    assert values(changed)["Fv1"] == pytest.approx(values(plain)["Fv1"], rel=0.05)


def test_report_model_and_result_are_written(identify: Identify, capture: Path, tmp_path: Path) -> None:
    out = tmp_path / "again"
    result = identify(capture, "--cutoff", 40, "--out", out)
    assert {path.name for path in out.iterdir()} == {"report.html", "result.json", "emps.model.toml"}
    assert json.loads((out / "result.json").read_text(encoding="utf-8")) == without_words(result)
    model = read_model(out / "emps.model.toml")
    assert model.identification.cutoff_hz == 40
    assert model.capture[0].name == "capture.mcap"
    assert model.estimate.verdict == result["test"]["verdict"]
    assert str(out / "report.html") in result["stderr"]


def test_two_captures_make_one_model(identify: Identify, capture: Path) -> None:
    one, two = identify(capture), identify(capture, capture)
    assert two["rows"] == 2 * one["rows"]
    assert values(two) == pytest.approx(values(one), rel=1e-6)


def test_what_a_damaged_capture_lacks_is_said(identify: Identify, capture: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    whole = capture.read_bytes()
    cut.write_bytes(whole[: len(whole) * 4 // 5])
    result = identify(cut)
    words = " ".join(result["stderr"].split())
    assert "warning:" in words and "the recording was not closed" in words
    assert any("the recording was not closed" in warning for warning in result["warnings"])


def other_capture(emps: Robot, folder: Path) -> Path:
    """Another motion of the same arm."""
    path = folder / "other.mcap"
    run = simulate_offline(emps, draw_truth(emps, 2), back_and_forth(emps)[::-1] * np.array([0.8]))
    with Recorder(path, emps, facts(emps, emps.bus.cycle_time)) as recorder:
        recorder.write(run.samples())
        recorder.finish(outcome(len(run.cycle)))
    return path


def test_a_capture_is_read_once(identify: Identify, capture: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Path] = []

    def counted(path: Path) -> Capture:
        read.append(path)
        return read_capture(path)

    monkeypatch.setattr("daq.recording.described_arm.read_capture", counted)
    monkeypatch.setattr("daq.importing.captures.read_capture", counted)
    identify(capture)
    assert read == [capture]


def test_a_held_out_capture_is_predicted(
    identify: Identify, capture: Path, emps: Robot, tmp_path: Path
) -> None:
    other = other_capture(emps, tmp_path)
    out = tmp_path / "out"
    result = identify(capture, "--validate", other, "--out", out)
    assert [(h["recording"], h["method"]) for h in result["held_out"]] == [
        ("other.mcap", "ls"),
        ("other.mcap", "iv"),
    ]
    own = result["estimates"]["ls"]["relative_error_percent"]["total"]
    assert 0 < result["held_out"][0]["relative_error_percent"]["total"] < 2 * own
    assert result["captures"] == [str(capture)]
    assert values(result) == values(identify(capture))
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Prediction of recordings that were not fitted to" in page and "other.mcap" in page


def test_methods_covariances_and_friction_by_name(identify: Identify, capture: Path, tmp_path: Path) -> None:
    plain = identify(capture)
    assert (plain["method"], plain["estimates"]["robust"]) == ("auto", None)
    alone = identify(capture, "--method", "ls")
    assert alone["estimates"]["iv"] is None and alone["recommended"] == "ls"
    assert identify(capture, "--method", "iv")["recommended"] == "iv"
    robust = identify(capture, "--method", "robust", "--out", tmp_path / "robust")
    assert robust["recommended"] == "robust"
    assert values(robust, "robust")["Fv1"] == pytest.approx(values(plain)["Fv1"], rel=0.05)
    assert read_model(tmp_path / "robust" / "emps.model.toml").estimate.estimator == "robust"
    ar, block = (identify(capture, "--covariance", name) for name in ("ar", "block"))
    assert values(ar) == values(block)
    assert values(ar, key="sigma") != values(block, key="sigma")
    assert "AR" in ar["estimates"]["ls"]["covariance"]
    assert identify(capture, "--friction", "asymmetric")["base_parameters"] == [
        "M1R",
        "Fvp1",
        "Fcp1R",
        "Fvn1",
        "Fcn1R",
    ]


def test_an_arm_that_can_exist_as_urdf(
    identify: Identify, capture: Path, emps: Robot, tmp_path: Path
) -> None:
    out, urdf = tmp_path / "out", tmp_path / "identified.urdf"
    result = identify(capture, "--method", "consistent", "--save-urdf", urdf, "--out", out)
    assert result["recommended"] == "consistent"
    near = result["consistency"]["nearest_to"]
    assert near == ("iv" if result["test"]["verdict"] == "endogenous" else "ls")
    assert result["consistency"]["links"][0]["mass"] == result["consistency"]["standard"]["M1"] > 0
    assert read_model(out / "emps.model.toml").estimate.estimator == "consistent"
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "The nearest arm that can exist" in page and "Physically consistent fit" in page
    assert str(urdf) in result["stderr"]
    found = values(result, "consistent")
    sigma = values(result, key="sigma")
    assert all(abs(found[name] - value) < sigma[name] for name, value in values(result, near).items())
    # pin's torque with the URDF, and what a URDF does not hold, are the torque of the estimate.
    assert_same_torques(urdf, emps, result["consistency"]["standard"], found)


def test_a_urdf_of_the_least_squares_estimate(
    identify: Identify, capture: Path, emps: Robot, tmp_path: Path
) -> None:
    urdf = tmp_path / "plain.urdf"
    result = identify(capture, "--method", "ls", "--save-urdf", urdf)
    model = pinocchio.buildModelFromUrdf(str(urdf))
    mass = model.inertias[1].mass
    # M1 and Ia1 are one base parameter here; the prior says how much of it is the carriage.
    prior = RegressorModel.of(emps)
    named = dict(zip(prior.names, prior.prior(), strict=True))
    assert 0.0 < mass < values(result)["M1R"]
    share = mass / values(result)["M1R"]
    assert share == pytest.approx(named["M1"] / (named["M1"] + named["Ia1"]), rel=0.1)
    assert "least squares" in urdf.read_text(encoding="utf-8")


def assert_same_torques(
    urdf: Path, robot: Robot, standard: dict[str, float], base_values: dict[str, float]
) -> None:
    base = base_parameters(RegressorModel.of(robot))
    state = random_states(robot, 3, 40)
    wanted = base.columns(state) @ np.array([base_values[name] for name in base.names])
    links = {name: standard[name] for name in link_parameter_names(robot.n)}
    rest = base.model.columns(state) @ base.model.standard_parameters(
        {name: value for name, value in standard.items() if name not in links}
    )
    model = pinocchio.buildModelFromUrdf(str(urdf))
    data = model.createData()
    rigid = np.array(
        [
            pinocchio.rnea(model, data, *now)
            for now in zip(state.position, state.velocity, state.acceleration, strict=True)
        ]
    )
    assert np.abs(rigid + rest - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_the_proposed_cutoff(identify: Identify, capture: Path) -> None:
    plain, proposed = identify(capture), identify(capture, "--cutoff", "auto")
    assert plain["signals"]["cutoff_hz"] == 100.0
    assert proposed["signals"]["cutoff_hz"] == plain["signals"]["proposed_cutoff_hz"]
    assert "proposed" in plain["stderr"] and "rank 4 of 4" in " ".join(plain["stderr"].split())


def test_essential_parameters(identify: Identify, capture: Path) -> None:
    assert identify(capture)["essential"] is None
    essential = identify(capture, "--essential")["essential"]
    assert {"M1R", "Fv1", "Fc1"} <= {p["name"] for p in essential["parameters"]}


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--method", "best"), f"--method best; allowed: {', '.join(METHODS)}"),
        (
            ("--save-urdf", "nowhere/arm.urdf"),
            "--save-urdf nowhere/arm.urdf: no folder nowhere; allowed: a file in an existing folder",
        ),
        (("--covariance", "big"), "--covariance big; allowed: iid, block, ar, hc, hac, cluster, bootstrap"),
        (("--friction", "none"), "--friction none; allowed: symmetric, asymmetric"),
        (("--cutoff", "abc"), "--cutoff abc; allowed: auto, or a number of Hz above 0"),
        (("--rate", "5000"), "--rate 5000 Hz; allowed: up to 1000 Hz, the sampling rate of capture.mcap"),
    ],
)
def test_an_option_that_cannot_be_is_refused(
    option: tuple[str, str], said: str, capture: Path, armhil: Call
) -> None:
    code, _, err = armhil("identify", capture, *option)
    assert code == 2
    assert err.splitlines()[-1] == f"armhil: {said}"


@pytest.mark.parametrize("option", [("--method", "consistent"), ("--save-urdf", "arm.urdf")])
def test_without_its_solver_the_consistent_fit_is_refused_at_once(
    option: tuple[str, str], capture: Path, monkeypatch: pytest.MonkeyPatch, armhil: Call
) -> None:
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    code, _, err = armhil("identify", capture, *option)
    assert code == 2
    assert err.splitlines()[-1] == (
        "armhil: the physically consistent fit needs cvxpy; install it with:"
        f" {sys.executable} -m pip install 'armhil[consistent]'"
    )


def test_the_arms_own_urdf_is_never_overwritten(
    capture: Path, tmp_path: Path, emps: Robot, armhil: Call
) -> None:
    arm = tmp_path / "arm"
    shutil.copytree(emps.folder, arm)
    before = (arm / emps.urdf).read_bytes()
    urdf = str(arm / emps.urdf)
    code, _, err = armhil("identify", capture, "--robot", arm, "--save-urdf", urdf)
    assert code == 2
    assert "is the arm's own description; allowed: another file" in err
    assert (arm / emps.urdf).read_bytes() == before


# Published recordings


def test_the_published_digits_of_emps(identify: Identify, shared_data: Path) -> None:
    result = identify(shared_data / "emps" / "DATA_EMPS.mat", "--robot", "emps")
    ls, names = result["estimates"]["ls"], result["base_parameters"]
    assert len(names) == 4
    assert [round(p["value"], 4) for p in ls["parameters"]] == [95.1089, 203.5034, 20.3935, -3.1648]
    assert [round(p["sigma"], 4) for p in ls["parameters"]] == [0.1085, 1.1460, 0.1012, 0.0444]
    assert round(ls["relative_error_percent"]["total"], 4) == 4.0834
    iv = [p["value"] for p in result["estimates"]["iv"]["parameters"]]
    assert iv == pytest.approx([95.18, 203.30, 20.41, -3.165], rel=1e-3)
    test = result["test"]
    assert test["verdict"] in {"exogenous", "endogenous", "instruments_invalid"}
    assert test["recommendation"] and all(gate["detail"] for gate in test["gates"])


def test_the_published_log_of_a_six_axis_arm(identify: Identify, shared_data: Path) -> None:
    result = identify(shared_data / "tx40", "--robot", "tx40")
    assert result["estimates"]["ls"]["relative_error_percent"]["total"] <= 7.34
    # Its position references were not published: nothing to simulate, so nothing to test against.
    assert result["estimates"]["iv"] is None
    assert "reference" in result["instrumental_reason"]
    assert result["test"]["verdict"] == "not_testable"
    assert "reference" in result["test"]["recommendation"]
    assert all(gate["passed"] is None for gate in result["test"]["gates"])
