"""``armhil plan --check``: trajectories of ours and of others, judged; and files that are none."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import robots
from daq.recording.trajectory_file import read_motion
from robots import Robot
from tests.daq.planning.conftest import Plan
from tests.daq.planning.plan_files import edited, recorded, write_swing


def test_check_judges_our_files_and_says_the_same_of_both(plan: Plan) -> None:
    planned = json.loads(plan("emps", "--out", "mine", "--json").out)
    exact = json.loads(plan("emps", "--check", "mine/emps.trajectory.json", "--json").out)
    for key in ("verdict", "condition", "score", "parameters", "seed", "family"):
        assert exact[key] == planned[key], key
    assert [entry["percent"] <= 100.1 for entry in exact["limits"]]
    sampled = json.loads(plan("emps", "--check", "mine/emps.trajectory.csv", "--json").out)
    assert sampled["family"] == "imported" and sampled["problems"] == []
    assert sampled["condition"] == pytest.approx(exact["condition"], rel=1e-3)
    assert any("only samples are known" in remark for remark in sampled["remarks"])
    assert "files" in exact and exact["files"] == {}


def test_check_judges_what_a_capture_recorded(
    plan: Plan, tmp_path: Path, emps: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan("emps", "--out", "mine")
    rows = np.loadtxt(tmp_path / "mine" / "emps.trajectory.csv", delimiter=",", skiprows=1)
    period = emps.bus.cycle_time
    recorded(tmp_path / "run.mcap", emps, rows[:, 1:2], monkeypatch)
    judged = plan("emps", "--check", "run.mcap", "--json")
    result = json.loads(judged.out)
    assert judged.code in (0, 1) and result["problems"] == []
    assert result["duration"] == pytest.approx(rows[-1, 0]) and result["cycle_time"] == pytest.approx(period)


@pytest.mark.parametrize(
    ("amplitude", "seconds", "kick", "constraint", "text"),
    [
        (0.4, 4.0, 0.0, "position", r"^carriage: position reaches 0\.4 at t = 2\.000 s; allowed: 0\.3$"),
        (0.25, 0.4, 0.0, "velocity", r"^carriage: velocity reaches .* at t = 0\.\d+ s; allowed: "),
        (0.05, 4.0, 0.01, "rest", r"^carriage: velocity at the end is 0\.01 at t = 4\.000 s; allowed: 0, "),
    ],
)
def test_a_motion_that_breaks_a_limit_must_not_be_driven(
    plan: Plan, tmp_path: Path, amplitude: float, seconds: float, kick: float, constraint: str, text: str
) -> None:
    write_swing(tmp_path / "swing.csv", amplitude, seconds, kick)
    answer = plan("emps", "--check", "swing.csv", "--json")
    assert answer.code == 2 and "MUST NOT BE DRIVEN" in answer.err
    problems = {problem["constraint"]: problem for problem in json.loads(answer.out)["problems"]}
    assert re.search(text, problems[constraint]["text"]), problems
    assert problems[constraint]["joint"] == "carriage"


def test_a_motion_that_shows_too_little_or_nothing_has_its_own_exit_code(plan: Plan, tmp_path: Path) -> None:
    write_swing(tmp_path / "dull.csv", 0.05)
    assert plan("emps", "--check", "dull.csv").code in (0, 1)
    rows = "\n".join(f"{k * 0.001},0" for k in range(20))
    (tmp_path / "still.csv").write_text("t,carriage\n" + rows)
    still = plan("emps", "--check", "still.csv")
    assert still.code in (1, 3) and "MAY BE DRIVEN" in still.out


def test_the_periods_of_a_slow_run_are_as_slow(plan: Plan, tmp_path: Path) -> None:
    made = plan("emps", "--periods", 3, "--json", "--out", "three")
    slow = plan("emps", "--check", "three/emps.trajectory.json", "--speed", 0.1, "--json", "--out", "slow")
    once, tenth = (json.loads(answer.out)["repeat"] for answer in (made, slow))
    assert once["count"] == tenth["count"] == 3 and once["period"] > 1.0
    assert tenth["period"] == pytest.approx(10 * once["period"])
    assert tenth["start"] == pytest.approx(10 * once["start"])
    written = read_motion(tmp_path / "slow" / "emps.trajectory.json", robots.load("emps"))
    assert written.repeat is not None
    assert (written.repeat.start, written.repeat.period) == (tenth["start"], tenth["period"])


def test_a_slow_run_of_a_file_is_judged_at_its_speed(plan: Plan, tmp_path: Path) -> None:
    plan("emps", "--out", "mine")
    slow = plan("emps", "--check", "mine/emps.trajectory.json", "--speed", 0.1, "--json", "--out", "slow")
    result = json.loads(slow.out)
    assert result["duration"] == pytest.approx(40.0) and result["speed"] == 0.1
    again = json.loads(plan("emps", "--check", "slow/emps.trajectory.json", "--json").out)
    assert again["duration"] == pytest.approx(40.0) and again["speed"] == 0.1


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("a.csv", "", r"a\.csv: is empty; allowed: a column of times and one per joint"),
        ("a.csv", "t,carriage\n0,0\n0.1,x\n", r"a\.csv: row 2: 'x' is not a number"),
        ("a.csv", "t,carriage\n0,0\n0.1\n", r"a\.csv: row 2 has 1 values; allowed: 2"),
        ("a.csv", "t,slide\n0,0\n", r"a\.csv: no column carriage; present: t, slide"),
        ("a.csv", "carriage\n0\n", r"a\.csv: no column time; present: carriage"),
        ("a.csv", "0,0,0\n1,0,0\n", r"a\.csv: 3 columns without names; allowed: 2, time and joints"),
        ("a.csv", "t,carriage\n0,0\n0.1,0\n", r"a\.csv: 2 samples; allowed: 8 or more"),
        (
            "a.csv",
            "t,carriage\n" + "".join(f"{k**1.1},0\n" for k in range(9)),
            r"samples are not evenly spaced",
        ),
        ("a.csv", "t,carriage\n" + "".join(f"{k},nan\n" for k in range(9)), r"row 1: 'nan' is not a number"),
        ("a.json", "{", r"a\.json: not JSON: "),
        ("a.json", "[]", r"a\.json: has no kind 'armhil trajectory'"),
        ("a.json", '{"kind": "armhil trajectory", "format": 9}', r"a\.json: format 9; allowed: 1"),
        ("a.json", '{"kind": "armhil trajectory", "format": 1}', r"a\.json: joints: missing"),
        ("a.mcap", "no capture", r"a\.mcap: "),
        ("a.toml", "", r"a\.toml: not a known kind of trajectory; allowed: \.trajectory\.json"),
    ],
)
def test_a_file_that_is_no_trajectory_is_named(
    plan: Plan, tmp_path: Path, name: str, content: str, line: str
) -> None:
    (tmp_path / name).write_text(content)
    assert re.search(line, plan("emps", "--check", name).refusal)


def test_a_file_of_another_arm_and_one_that_is_not_there_are_named(plan: Plan) -> None:
    assert plan("emps", "--check", "none.csv").refusal == "none.csv: no such file; allowed: a trajectory"
    plan("emps", "--out", "mine")
    line = plan("tx40", "--check", "mine/emps.trajectory.json").refusal
    assert line.startswith("mine/emps.trajectory.json: is for the joints carriage; allowed: joint_1, ")


def test_a_file_with_a_jump_is_refused_with_joint_and_time(plan: Plan, tmp_path: Path) -> None:
    plan("emps", "--out", "mine")
    path = tmp_path / "mine" / "emps.trajectory.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    positions = content["motion"]["position"][0]
    positions[len(positions) // 2] += 0.01
    path.write_text(json.dumps(content))
    line = plan("emps", "--check", path).refusal
    assert re.search(r"position of joint 1 jumps by 0\.01 at t = \d+\.\d+ s$", line)


def test_a_description_that_changed_since_is_said(plan: Plan, tmp_path: Path) -> None:
    plan("emps", "--out", "mine")
    other = edited(tmp_path / "other", "emps", (r"^name = ", "# another version\nname = "))
    result = json.loads(plan(other, "--check", "mine/emps.trajectory.json", "--json").out)
    assert any("another version of this arm's description" in remark for remark in result["remarks"])
