"""``armhil plan`` under the hands of a user: files, verdicts, exit codes, and what wrong inputs get."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import robots
from daq.files.model_file import read_model, write_model
from drivers.simulated import draw_truth, simulate_offline
from robots import Robot
from tests.daq.models import carriage
from tests.daq.planning.conftest import SMALL, Plan
from tests.daq.planning.plan_files import PAGE, ROOT, edited, recorded

# What comes out


def test_a_plan_writes_its_files_and_says_what_it_is_worth(plan: Plan, tmp_path: Path) -> None:
    answer = plan("emps", "--evaluations", 400, "--seed", 4, "--out", "mine")
    assert answer.code == 0
    assert "MAY BE DRIVEN, AND SHOWS WHAT WAS ASKED FOR" in answer.out
    for what in ("Predicted, before anything moves", "Use of the limits", "carriage", "Fc1", "drive torque"):
        assert what in answer.out, what
    names = {"emps.trajectory.json", "emps.trajectory.csv", "plan.html", "plan.json"}
    assert {path.name for path in (tmp_path / "mine").iterdir()} == names


def test_the_same_seed_is_the_same_file_and_another_is_not(plan: Plan, tmp_path: Path) -> None:
    for folder, seed in (("a", 1), ("b", 1), ("c", 2)):
        plan("emps", "--seed", seed, "--out", folder)
    for name in ("emps.trajectory.json", "emps.trajectory.csv", "plan.html"):
        first, again, other = ((tmp_path / folder / name).read_bytes() for folder in "abc")
        assert first == again, name
        assert first != other, name


def test_json_has_the_keys_of_the_reference_page_and_no_others(plan: Plan, tmp_path: Path) -> None:
    asked = ("--parameters", "friction1", "--for", "hysteresis@1=1e6")
    answer = plan("emps", "--periods", 2, *asked, "--json", "--out", "mine")
    result = json.loads(answer.out)
    assert result == json.loads((tmp_path / "mine" / "plan.json").read_text(encoding="utf-8"))
    text = PAGE.read_text(encoding="utf-8").split("\n## plan --json\n", 1)[1]
    text = re.split(r"^#+ ", text, maxsplit=1, flags=re.MULTILINE)[0]
    documented = {
        key for cell in re.findall(r"^\| ([^|]*) \|", text, re.MULTILINE) for key in key_names(cell)
    }
    assert documented == set(keys_of(result)) | {"problems", "payload", "nearest"} | below_empty()
    assert result["repeat"] == {"start": 0.0, "period": pytest.approx(4.0), "count": 2}
    assert {entry["constraint"] for entry in result["limits"]} == {
        "position",
        "velocity",
        "acceleration",
        "jerk",
        "torque",
        "drive torque",
    }
    assert result["verdict"] == {0: "fine", 1: "weak"}[answer.code]
    assert "MAY BE DRIVEN" in answer.err


def key_names(cell: str) -> list[str]:
    return re.findall(r"`([a-z_.]+)`", cell)


def keys_of(value: object, above: str = "") -> list[str]:
    """Every key below a value, as ``limits.joint``; keys that are names of joints or files are left out."""
    if isinstance(value, list):
        return sorted({key for entry in value for key in keys_of(entry, above)})
    if not isinstance(value, dict):
        return []
    keys = []
    for key, entry in value.items():
        if above in {"files.", "rows.used_percent.", "power.smallest.shape."}:
            continue
        keys.append(above + key)
        keys += keys_of(entry, f"{above}{key}.")
    return keys


def below_empty() -> set[str]:
    """Keys of what this plan has none of: problems, a payload, bodies that could touch."""
    return {
        *(f"problems.{key}" for key in ("constraint", "joint", "time", "text")),
        *(f"payload.{key}" for key in ("name", "sigma", "unit")),
        *(f"nearest.{key}" for key in ("distance", "at_least", "bodies", "joint", "time")),
    }


def test_a_payload_is_predicted_where_it_is_asked_for(plan: Plan) -> None:
    result = json.loads(plan("tx40", "--parameters", "payload", "--json", "--evaluations", 30).out)
    assert [(entry["name"], entry["unit"]) for entry in result["payload"]] == [
        ("M6", "kg"),
        ("MX6", "kg·m"),
        ("MY6", "kg·m"),
        ("MZ6", "kg·m"),
    ]
    assert all(entry["sigma"] > 0.0 for entry in result["payload"])
    assert result["nearest"]["distance"] >= 0.01 and len(result["nearest"]["bodies"]) == 2


def test_an_earlier_model_gives_the_values_to_expect(plan: Plan, tmp_path: Path, emps: Robot) -> None:
    (tmp_path / "carriage.csv").write_text("")
    write_model(tmp_path / "emps.model.toml", carriage(emps), [tmp_path / "carriage.csv"], emps)
    expected = {p.name: p for p in read_model(tmp_path / "emps.model.toml").parameter}
    result = json.loads(plan("emps", "--earlier", "emps.model.toml", "--json").out)
    for parameter in result["parameters"]:
        known = expected[parameter["name"]]
        assert parameter["value"] == known.value
        spread = np.hypot(known.sigma, parameter["sigma"])
        if spread < 0.1 * abs(known.value):
            percent = 100 * parameter["sigma"] / abs(known.value)
            assert parameter["percent_sigma"] == pytest.approx(percent, rel=1e-3)
    line = plan("tx40", "--earlier", "emps.model.toml").refusal
    assert line.startswith("emps.model.toml: has no parameter ZZ1R") and line.endswith("a model of tx40")


def test_an_earlier_capture_gives_the_errors_to_expect(
    plan: Plan, tmp_path: Path, emps: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = json.loads(plan("emps", "--json", "--out", "first", "--periods", 3).out)
    rows = np.loadtxt(tmp_path / "first" / "emps.trajectory.csv", delimiter=",", skiprows=1)
    run = simulate_offline(emps, draw_truth(emps, 1), rows[:, 1:2])
    recorded(tmp_path / "run.mcap", emps, rows[:, 1:2], monkeypatch, run.position, run.control_signal)
    second = json.loads(plan("emps", "--earlier", "run.mcap", "--json", "--seed", 1).out)
    assert "residuals of run.mcap" in second["rows"]["noise"]
    assert first["rows"]["noise"] != second["rows"]["noise"]
    assert [p["value"] for p in first["parameters"]] != [p["value"] for p in second["parameters"]]


# A cell


CELL = """format = 1
floor = -0.3
clearance = 0.02
[tool]
frame = "link_6"
offset = [0.0, 0.0, 0.1]
speed = 0.6
[[obstacle]]
name = "table"
centre = [0.0, 0.7, 0.1]
size = [0.6, 0.3, 0.4]
turn = 0.3
"""


def test_a_cell_is_kept_and_the_command_line_is_above_it(plan: Plan, tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(CELL)
    search = ("--duration", 6, "--evaluations", 100)
    result = json.loads(plan("tx40", *search, "--cell", "cell.toml", "--json", "--out", "mine").out)
    assert result["tool"]["limit"] == 0.6 and result["tool"]["speed"] <= 0.6
    assert result["nearest"]["distance"] >= 0.02 and result["problems"] == []
    page = (tmp_path / "mine" / "plan.html").read_text(encoding="utf-8")
    assert "table" in page and "floor at -0.3 m" in page
    judged = plan(
        "tx40", "--check", "mine/tx40.trajectory.json", "--cell", "cell.toml", "--tool-speed", 0.05, "--json"
    )
    assert judged.code == 2
    problem = json.loads(judged.out)["problems"][0]
    assert problem["constraint"] == "tool speed" and problem["joint"].startswith("joint_")
    assert 0.0 < problem["time"] < 6.0 and "allowed: 0.05 m/s" in problem["text"]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (("floor = -0.3", "flor = -0.3"), r"cell\.toml:2: flor: .* does not exist; allowed: .*floor"),
        (("floor = -0.3", 'floor = "low"'), r'cell\.toml:2: floor: "low" is not allowed; allowed: '),
        (("speed = 0.6", "speed = 0"), r"cell\.toml:7: tool\.speed: 0 is not allowed; allowed: .*0"),
        (("[0.6, 0.3, 0.4]", "[0.6, 0.3]"), r"cell\.toml:11: obstacle\[1\]\.size"),
        (('name = "table"', 'name = ""'), r"cell\.toml:9: obstacle\[1\]\.name"),
        (("format = 1", "format = 2"), r"cell\.toml:1: format: 2 is not allowed; allowed: 1"),
        (("format = 1", "format = "), r"cell\.toml: not TOML: "),
        (('frame = "link_6"', 'frame = "hand"'), r"^no tool frame 'hand' in the URDF; allowed: .*link_6"),
    ],
)
def test_a_cell_file_with_a_mistake_is_named_with_its_line(
    plan: Plan, tmp_path: Path, change: tuple[str, str], line: str
) -> None:
    assert change[0] in CELL
    (tmp_path / "cell.toml").write_text(CELL.replace(*change))
    assert re.search(line, plan("tx40", "--cell", "cell.toml").refusal)


# What cannot be met


@pytest.mark.parametrize(
    ("robot", "arguments", "line"),
    [
        (
            "tx40",
            ("--start", "0,2.1,2.4,0,1.5,0"),
            r"^joint_5: start puts base_link \d+\.\d mm into link_5; allow",
        ),
        ("tx40", ("--start", "5,0,0,0,0,0"), r"^joint_1: start position is 5; allowed: -3\.1\d+ to 3\.1\d+$"),
        ("tx40", ("--start", "nan,0,0,0,0,0"), r"^joint_1: start position is nan; allowed: "),
        ("tx40", ("--start", "0,0"), r"^start has 2 values; allowed: 6, one per joint$"),
        ("tx40", ("--start", "here"), r"^--start here; allowed: one number per joint, separated by commas$"),
        ("tx40", ("--floor", "0.5"), r"^joint_2: home puts link_2 \d+\.\d mm into floor; allowed: 10\.0 mm"),
        ("tx40", ("--floor", "nan"), r"^floor is at nan m; allowed: a height in the base frame$"),
        (
            "tx40",
            ("--duration", "0.2"),
            r"^joint_4: no motion out of the start and back fits into 0\.2 s, its jerk",
        ),
        ("emps", ("--tool-speed", "1e-4"), r"^tool speed of 0\.0001 m/s leaves no time for a motion in 4 s"),
        ("emps", ("--tool-speed", "-1"), r"^tool speed is -1\.0 m/s; allowed: above 0$"),
        (
            "emps",
            ("--family", "fourier", "--duration", "0.5"),
            r"^0\.5 s leave no period between lead-in and",
        ),
        ("emps", ("--family", "spline"), r"^--family spline; allowed: ruckig, fourier$"),
        ("emps", ("--objective", "best"), r"^--objective best; allowed: determinant, trace, condition$"),
        ("emps", ("--parameters", "ZZ9"), r'^no base parameter is meant by "ZZ9"; allowed: .*Fc1'),
        ("emps", ("--speed", "0"), r"^speed is 0\.0; allowed: above 0, up to 1$"),
        ("emps", ("--cycle-time", "0"), r"^cycle time is 0\.0 s; allowed: above 0$"),
        (
            "emps",
            ("--cycle-time", "9"),
            r"too few to identify; allowed: a longer duration or a shorter cycle$",
        ),
        ("emps", ("--earlier", "none.mcap"), r"^none\.mcap: no such file"),
        ("emps", ("--cell", "none.toml"), r"^none\.toml: no such file; allowed: a cell file"),
    ],
)
def test_what_cannot_be_met_is_one_line(
    plan: Plan, robot: str, arguments: tuple[str, ...], line: str
) -> None:
    assert re.search(line, plan(robot, *arguments).refusal)


def test_limits_of_an_arm_that_cannot_be_met_are_named(plan: Plan, tmp_path: Path) -> None:
    jerk = edited(tmp_path / "zero", "emps", (r"^jerk = .*$", "jerk = 0.0"))
    assert re.search(r"robot\.toml:\d+: joint\[1\]\.jerk: 0\.0 .*allowed: .*0", plan(jerk).refusal)
    slow = edited(tmp_path / "slow", "emps", (r"^acceleration = .*$", "acceleration = 1e-5"))
    assert re.search(
        r"robot\.toml:\d+: joint\[1\]\.acceleration: 1e-05 .*allowed: a number from 0\.001",
        plan(slow).refusal,
    )
    weak = edited(tmp_path / "weak", "tx40", *[(r"^torque = (?!5\.0).*$", "torque = 5.0")] * 2)
    line = plan(weak).refusal
    assert re.search(
        r"robot\.toml:\d+: drive\[1\]\.gain: .* the joints' torque limits ask for 5; allowed: ", line
    )


# Ctrl-C


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_control_c_keeps_the_best_so_far(tmp_path: Path, workers: int) -> None:
    command = [sys.executable, "-m", "daq", "plan", "emps", *map(str, SMALL), "--json", "--out", "mine"]
    command += ["--evaluations", "100000000", "--searches", "2", "--workers", str(workers)]
    there, here = pty.openpty()  # on a terminal the search says how good its best motion is
    with (tmp_path / "out.json").open("w") as out:
        child = subprocess.Popen(
            command,
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "80"},
            stdout=out,
            stderr=here,
            start_new_session=True,
        )
    os.close(here)
    shown, asked = b"", False
    while True:
        try:
            shown += os.read(there, 4096)
        except OSError:  # the terminal is closed on the other side
            break
        if not asked and b"score" in shown:
            os.killpg(child.pid, signal.SIGINT)  # as a terminal does: to every process of the group
            asked = True
    os.close(there)
    err = shown.decode()
    assert child.wait(60) in (0, 1), err
    result = json.loads((tmp_path / "out.json").read_text())
    assert result["stopped"] is True and "Traceback" not in err
    assert result["problems"] == [] and result["evaluations"] < 100_000_000
    assert any("stopped early" in remark for remark in result["remarks"])
    robot = robots.load("emps")
    rows = np.loadtxt(tmp_path / "mine" / "emps.trajectory.csv", delimiter=",", skiprows=1)
    assert rows[-1, 0] == pytest.approx(4.0)
    assert (np.abs(rows[:, 2]) <= robot.velocity_limits[0]).all()
