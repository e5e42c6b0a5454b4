"""Trajectory files: exact both ways, the same bytes again, and every key on the reference page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from daq.recording.trajectory_file import (
    TrajectoryFileError,
    description_sha256,
    read_motion,
    write_samples,
    write_trajectory,
)
from robots import Robot
from trajectories import Trajectory, plan
from trajectories.motion_data import motion_data, motion_of

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "trajectory-file.md"


def planned(robot: Robot, **changes: object) -> Trajectory:
    arguments: dict[str, object] = {"cycle_time": 0.004, "duration": 4.0, "seed": 1, "evaluations": 60}
    return plan(robot, **(arguments | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize("family", ["ruckig", "fourier"])
@pytest.mark.parametrize("speed", [1.0, 0.5])
def test_a_motion_comes_back_exactly(tmp_path: Path, emps: Robot, family: str, speed: float) -> None:
    trajectory = planned(emps, family=family, speed=speed, periods=2, start=[0.1])
    path, again = tmp_path / "a.trajectory.json", tmp_path / "b.trajectory.json"
    write_trajectory(path, trajectory, emps)
    write_trajectory(again, trajectory, emps)
    assert path.read_bytes() == again.read_bytes()
    found = read_motion(path, emps)
    time = np.linspace(0.0, trajectory.duration, 999)
    for name in ("position", "velocity", "acceleration", "jerk"):
        np.testing.assert_array_equal(
            getattr(found.motion.at(time), name), getattr(trajectory.at(time), name), err_msg=name
        )
    assert found.is_exact and found.cycle_time == trajectory.cycle_time
    assert (found.family, found.seed, found.speed) == (family, 1, speed)
    assert found.repeat == trajectory.repeat and found.score == trajectory.score
    assert found.robot_sha256 == description_sha256(emps)


def test_samples_come_back_digit_by_digit(tmp_path: Path, tx40: Robot) -> None:
    trajectory = planned(tx40, duration=6.0, evaluations=30)
    path = tmp_path / "a.csv"
    write_samples(path, trajectory, tx40)
    found = read_motion(path, tx40)
    assert not found.is_exact and found.cycle_time == pytest.approx(0.004, rel=1e-12)
    np.testing.assert_allclose(found.motion.at(trajectory.time).position, trajectory.position, atol=1e-14)
    header, *rows = path.read_text().splitlines()
    assert header.split(",")[:2] == ["time", "joint_1"] and header.endswith("joint_6_acceleration")
    values = np.array([[float(x) for x in row.split(",")] for row in rows])
    np.testing.assert_array_equal(values[:, 1:7], trajectory.position)
    np.testing.assert_array_equal(values[:, 13:], trajectory.acceleration)


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_tables_of_other_programs_are_read(tmp_path: Path, emps: Robot, mark: str) -> None:
    rows = [f"{0.01 * k!r}{mark}{0.001 * k * k!r}" for k in range(20)]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(["# from elsewhere", f"time [s]{mark}carriage", *rows]))
    bare = tmp_path / "b.csv"
    bare.write_text("\n".join(rows))
    for file in (path, bare):
        found = read_motion(file, emps)
        assert found.motion.duration == pytest.approx(0.19) and found.family == "imported"
        np.testing.assert_allclose(found.motion.at(np.array([0.1])).position, [[0.1]], atol=1e-12)


def test_the_page_has_every_key(tmp_path: Path, emps: Robot) -> None:
    text = PAGE.read_text(encoding="utf-8").split("\n## *.trajectory.json\n", 1)[1]
    top, motions = text.split("\nA motion is one of four kinds", 1)
    path = tmp_path / "a.trajectory.json"
    kinds = {}
    for family, speed, start in (("ruckig", 1.0, None), ("fourier", 0.5, [0.1])):
        write_trajectory(path, planned(emps, family=family, speed=speed, start=start, periods=2), emps)
        content = json.loads(path.read_text())
        assert set(re.findall(r"^\| `(\w+)` \|", top, re.MULTILINE)) == set(content)
        pending = [content["motion"]]
        while pending:
            motion = pending.pop()
            kinds[motion["kind"]] = set(motion) - {"kind"}
            pending += motion.get("parts", []) + ([motion["motion"]] if "motion" in motion else [])
    documented = {
        kind: set(re.findall(r"`(\w+)`", keys))
        for kind, keys in re.findall(r"^\| `(\w+)` \| ([^|]*) \|", motions, re.MULTILINE)
        if kind != "kind"
    }
    assert kinds == documented


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"cycle_time": 0}, r"cycle_time: 0; allowed: a number from 1e-06"),
        ({"speed": "fast"}, r"speed: \"fast\"; allowed: a number from 1e-06"),
        ({"motion": {}}, r"not a motion: KeyError 'kind'"),
        ({"motion": {"kind": "spline"}}, r"motion of kind 'spline'; allowed: jerk, fourier, stretched, sequ"),
        ({"motion": 3}, r"not a motion: TypeError"),
        ({"joints": ["a"]}, r"is for the joints a; allowed: carriage"),
        ({"repeat": []}, r"not a trajectory: "),
    ],
)
def test_a_file_that_was_changed_is_refused(
    tmp_path: Path, emps: Robot, change: dict[str, object], problem: str
) -> None:
    path = tmp_path / "a.trajectory.json"
    write_trajectory(path, planned(emps), emps)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(TrajectoryFileError, match=problem):
        read_motion(path, emps)


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("start", [[0.0]], "phases of a jerk motion differ in number"),
        ("jerk", [[float("nan")]], "allowed: 1 joints × numbers, to"),
        ("duration", -1.0, "duration of a motion is -1; allowed: above 0"),
    ],
)
def test_a_motion_whose_numbers_make_none_is_refused(
    emps: Robot, key: str, value: object, problem: str
) -> None:
    data = motion_data(planned(emps).motion)
    with pytest.raises(ValueError, match=problem):
        motion_of(data | {key: value}, 1)
