"""A log and a URDF are enough for every command that reads logs: the same answer by each way."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from daq.text.numbers import percent
from tests.daq.calls import Call

URDF = Path(__file__).parents[3] / "robots" / "emps" / "emps.urdf"
MASS, VISCOUS, DRY = 95.0, 200.0, 20.0


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A sliding axis with friction, 12 s at 500 Hz."""
    noise = np.random.default_rng(11)
    t = 0.002 * np.arange(6000)
    q = 0.1 + 0.05 * np.sin(2.0 * t) + 0.02 * np.sin(7.0 * t + 1.0)
    v = 0.1 * np.cos(2.0 * t) + 0.14 * np.cos(7.0 * t + 1.0)
    a = -0.2 * np.sin(2.0 * t) - 0.98 * np.sin(7.0 * t + 1.0)
    force = MASS * a + VISCOUS * v + DRY * np.sign(v) + 0.2 * noise.standard_normal(t.size)
    path = tmp_path / "log.csv"
    table = np.column_stack([t, q + 1e-7 * noise.standard_normal(t.size), force])
    np.savetxt(path, table, delimiter=",", header="t,q1,tau1", comments="")
    return path


def test_an_imported_log_needs_no_description(armhil: Call, log: Path, tmp_path: Path) -> None:
    """It carries its own, without drives."""
    capture, kept = tmp_path / "log.capture.mcap", tmp_path / "kept"
    code, out, err = armhil("import", log, "--urdf", URDF, "--out", capture, "--save-robot", kept)
    assert code == 0, err
    assert "tau1" in out
    assert {file.name for file in kept.iterdir()} == {"robot.toml", "arm.urdf", "import.toml"}
    values = []
    for words in ([capture], [log, "--urdf", URDF], [log, "--robot", kept / "robot.toml"]):
        _, out, _ = armhil("identify", *words, "--json", "--quiet", "--no-catalogue")
        parameters = json.loads(out)["estimates"]["ls"]["parameters"]
        values.append({p["name"]: p["value"] for p in parameters})
    assert values[0] == pytest.approx(values[1], rel=1e-6)
    assert values[1] == values[2]
    assert values[0]["Fc1"] == pytest.approx(DRY, rel=0.05)
    code, out, err = armhil("identify", log, "--robot", kept / "robot.toml", "--out", tmp_path / "mine")
    assert code in (0, 1), err
    assert "the loop is not simulated" in (tmp_path / "mine" / "report.html").read_text("utf-8")
    assert list((tmp_path / "mine").glob("*.model.toml"))


@pytest.mark.slow
def test_a_diagnosis_of_a_log_with_its_urdf(armhil: Call, log: Path, tmp_path: Path) -> None:
    words = ["--urdf", URDF, "--split-half", "--save-map", tmp_path / "map.toml"]
    words += ["--out", tmp_path / "why"]
    _, out, err = armhil("diagnose", log, *words, "--json", "--quiet", "--no-catalogue")
    content = json.loads(out)
    assert not any(one["confirmed"] for one in content["findings"])
    assert content["unexplained"][0]["unexplained_percent"] < 0.1
    assert "position: q1" in err
    assert "no position reference was recorded" in (tmp_path / "why" / "diagnosis.html").read_text("utf-8")
    assert 'columns = ["tau1"]' in (tmp_path / "map.toml").read_text(encoding="utf-8")


@pytest.mark.slow
def test_an_axis_that_lacks_nothing_is_clean_without_a_model_from_before(armhil: Call, log: Path) -> None:
    words = ["--urdf", URDF, "--split-half", "--json", "--quiet", "--no-catalogue"]
    assert json.loads(armhil("diagnose", log, *words)[1])["verdict"] == "clean"


def test_what_says_of_which_arm_a_log_is(armhil: Call, log: Path) -> None:
    assert "--urdf of the log's arm" in armhil("import", log)[2]
    assert "allowed: one of" in armhil("import", log, "--urdf", URDF, "--columns", "map.toml")[2]
    assert "--robot and --urdf" in armhil("diagnose", log, "--urdf", URDF, "--robot", "emps")[2]


def test_the_error_of_a_joint_is_the_same_wherever_it_is_shown(
    armhil: Call, log: Path, tmp_path: Path
) -> None:
    """In the terminal's table and its worst joint, in JSON, in result.json and in the report."""
    words = ("identify", log, "--urdf", URDF, "--quiet", "--no-catalogue", "--out", tmp_path / "run")
    _, out, said = armhil(*words, "--json")
    answer = json.loads(out)
    (error,) = answer["estimates"]["ls"]["relative_error_percent"]["per_joint"]
    assert answer["worst_joint"]["relative_error_percent"] == error
    kept = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    assert kept["worst_joint"] == answer["worst_joint"]
    shown = percent(error)
    assert f" carriage {shown} ".split() == said[said.index(" carriage ") :].split()[:3]
    assert f"of whose torque {shown} is left" in said
    assert shown in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
