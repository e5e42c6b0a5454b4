"""An arm that is not as described is found out before torque, at rest, by a touch or by half a degree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from daq.session import first_stage
from daq.session.cell import Cell
from daq.session.first_judgement import described_gravity, judge_rest
from daq.session.first_motion import (
    HALF_DEGREE,
    direction_question,
    half_degree,
    in_order,
    refuse_in_the_way,
    touch,
)
from daq.session.session_error import SessionError
from tests.daq.session.wrong_arms import WrongArm
from tests.daq.session.wrong_descriptions import (
    SINGLE,
    Slip,
    before_torque,
    drive,
    pairs,
    position_sign,
    right_arm,
    torque_sign,
)

TX40 = robots.load("tx40")
UNSEEN = ("sign of drive", "zero of drive", "nodes 3 and 5 swapped", "nodes 5 and 6 swapped")
"""What physics cannot tell at every posture, and only somebody can who compares posture and reading."""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tx40", "emps"])
def test_the_right_description_passes(name: str) -> None:
    robot = robots.load(name)
    for seed in range(4 if name == "tx40" else 10):
        arm = right_arm(robot, 500 + seed)
        assert arm.first_contact() == "", [str(finding) for finding in arm.findings]
        assert arm.farthest <= 1.3 * HALF_DEGREE[robot.joint[0].kind]


CASES = (*SINGLE, *pairs(14))


def test_there_are_forty() -> None:
    assert len(CASES) >= 40
    assert len({words for words, _ in CASES}) == len(CASES)


@pytest.mark.slow
@pytest.mark.parametrize("k", range(len(CASES)), ids=lambda k: CASES[k][0])
def test_a_wrong_description_is_caught_and_nothing_moves_by_a_degree(k: int) -> None:
    words, slip = CASES[k]
    arm = slip(right_arm(TX40, k))
    before = before_torque(arm)
    caught = before or arm.first_contact()
    assert caught, words
    assert np.degrees(arm.farthest) < 1.0
    if not before and caught != "by a look at half a degree":
        assert arm.findings and all(finding.joint.startswith("joint_") for finding in arm.findings)


@pytest.mark.slow
@pytest.mark.parametrize(
    "slip", [case for case in SINGLE if not case[0].startswith(UNSEEN)], ids=lambda s: s[0]
)
def test_physics_alone_catches_it_too(slip: Slip) -> None:
    """Where the arm stands at its zero, or the drive has no 608F, nothing before torque would."""
    arm = slip[1](right_arm(TX40, 7))
    assert arm.first_contact(looked=False) in ("at rest", "by a touch", "by half a degree")
    assert np.degrees(arm.farthest) < 1.0
    if slip[0].startswith("control_signal.sign"):
        advice = [f.text for f in arm.findings if "the sign is likely wrong" in f.text]
        assert any("control_signal.sign" in text for text in advice), arm.findings


@pytest.mark.parametrize("k", [0, 1, 2])
@pytest.mark.parametrize("true_sign", [1, -1])
@pytest.mark.parametrize("slip", ["none", "both", "torque", "position"])
def test_all_ways_to_mistake_a_sign(k: int, true_sign: int, slip: str) -> None:
    """Of positions, of torque, or of both: physics tells where they disagree, and a look where they agree.

    A drive that counts both the wrong way round is its own mirror image; a drive that counts them in
    different senses is one whose loop pushes the wrong way.
    """
    robot = right_arm(TX40, 0).wrong
    drives_ = list(robot.drive)
    drives_[k] = drives_[k].model_copy(update={"sign": true_sign})
    true = robot.model_copy(update={"drive": tuple(drives_)})
    slips = {
        "none": lambda arm: arm,
        "both": drive(k, "sign", -1),
        "torque": torque_sign(k),
        "position": position_sign(k),
    }
    posture = np.array(TX40.home) + np.array([0.0, 0.6, 0.4, 0.0, 0.0, 0.0])
    arm = slips[slip](replace(right_arm(true, 3), posture=posture))
    caught = arm.first_contact()
    text = " ".join(str(finding) for finding in arm.findings)
    if slip == "none":
        assert caught == "", text
    elif slip == "both":
        assert caught, "at the latest by a look"
        assert caught == "by a look at half a degree" or f"other sign of drive[{k + 1}]" in text, text
    else:
        assert caught in ("at rest", "by a touch"), caught
        assert f"drive[{k + 1}]" in text and "the sign is likely wrong" in text, text
        assert "control_signal.sign" in text, text
    assert np.degrees(arm.farthest) < 1.0


def test_a_turned_drive_of_a_coupled_joint_is_seen_before_it_takes_another_joint_along() -> None:
    """At its zero no posture and no torque tells; joint 6, which drive 6 moves alone, has its turn first."""
    assert in_order(TX40) == [0, 1, 2, 3, 5, 4]
    arm = replace(drive(5, "sign", -1)(right_arm(TX40, 3)), posture=np.array(TX40.home))
    assert arm.first_contact() == "by a look at half a degree"
    assert np.degrees(arm.farthest) < 0.7


def test_the_question_says_which_way_a_joint_should_have_gone() -> None:
    posture = np.array(TX40.home)
    first = direction_question(TX40, half_degree(TX40, posture, [0]))
    assert first == (
        "Did joint_1 go first by 0.5° counter-clockwise, seen from the +z side of the URDF's base?"
    )
    posture[0] = TX40.upper[0]
    first = direction_question(TX40, half_degree(TX40, posture, [0]))
    assert "by 0.5° clockwise" in first, "at the end of its travel there is one way only"
    posture[0] = np.radians(90.0)
    second = direction_question(TX40, half_degree(TX40, posture, [1]))
    assert second.endswith("seen from the -x side of the URDF's base?")
    emps = robots.load("emps")
    assert direction_question(emps, half_degree(emps, np.array(emps.home), [0])) == (
        "Did carriage go first by 0.5 mm towards the +x side of the URDF's base?"
    )


def test_gravity_of_the_other_sign_is_told_at_rest() -> None:
    """Of a joint that bears more than friction hides; and what friction does hide is said."""
    arm = right_arm(TX40, 1)
    posture = np.array([0.0, np.pi / 2, 0.0, 0.0, 0.0, 0.0])
    gravity = described_gravity(TX40, posture)
    samples = standing(arm, posture, gravity)
    assert judge_rest(TX40, samples) == ([], ["joint_1", "joint_3", "joint_4", "joint_5", "joint_6"])
    found = judge_rest(TX40, standing(arm, posture, -gravity))[0]
    assert {finding.joint for finding in found} == {"joint_2"}
    assert all("the sign is likely wrong" in finding.text for finding in found)
    (found,) = (f for f in judge_rest(TX40, standing(arm, posture, 3.0 * gravity))[0])
    assert (found.joint, "gain" in found.text) == ("joint_2", True)


def standing(arm: WrongArm, posture: np.ndarray, torque: np.ndarray) -> object:
    from drivers.frames.samples import Samples

    rows = np.ones((50, 1))
    return Samples(
        cycle=np.arange(50),
        time=np.arange(50) * 0.004,
        reference=rows * posture,
        position=rows * posture,
        control_signal=rows * arm.true.control_signal(torque),
        statusword=np.full((50, 6), 0x1237, dtype=np.uint16),
        complete=np.ones((50, 6), dtype=np.bool_),
        lateness=np.zeros(50),
    )


def test_the_motions_are_small_begin_and_end_at_rest_and_stay_inside_the_limits() -> None:
    posture = np.array(TX40.home)
    posture[1] = TX40.upper[1]
    for motion, size in ((touch, np.radians(0.015)), (half_degree, np.radians(0.5))):
        made = motion(TX40, posture, range(6))
        position = np.asarray(made.trajectory.position)
        assert np.abs(position - posture).max() == pytest.approx(size)
        assert (position <= TX40.upper + 1e-12).all() and (position >= TX40.lower - 1e-12).all()
        np.testing.assert_allclose(position[[0, -1]], [posture, posture], rtol=0.0, atol=1e-12)
        for turn in made.turns:
            others = np.delete(position[turn.rows], turn.joint, axis=1)
            assert np.ptp(others, axis=0).max() < 1e-12


@pytest.mark.parametrize("wrong", [None, 0, 4])
def test_a_joint_that_somebody_saw_go_the_other_way_ends_the_stage(
    monkeypatch: pytest.MonkeyPatch, wrong: int | None
) -> None:
    """All that torque tells is as described; then each joint is asked for once it has moved."""
    done: list[str] = []
    asked: list[str] = []
    for judge in ("judge_loop", "judge_move"):
        monkeypatch.setattr(first_stage, judge, lambda *_: [])
    monkeypatch.setattr(first_stage, "judge_rest", lambda *_: ([], []))
    monkeypatch.setattr(first_stage, "require_completed", lambda *_: None)
    monkeypatch.setattr(first_stage, "read_capture", lambda _: SimpleNamespace(samples=None))
    session = SimpleNamespace(robot=TX40, actual_position=lambda: np.array(TX40.home))
    recording = SimpleNamespace(record=lambda kind, title, *_, **__: (done.append(title), None))

    def saw(question: str) -> bool:
        asked.append(question)
        assert done[-1].endswith("0.5 deg"), "what is asked for has just been driven"
        return wrong is None or TX40.joint[wrong].name not in question

    def stage() -> str:
        arm: Any = SimpleNamespace(session=session)
        return first_stage.first_move(arm, recording, Path, {}, saw)  # type: ignore[arg-type]

    if wrong is None:
        assert stage().startswith("every joint answers as described")
        assert all(f"joint_{k + 1}" in question for k, question in zip(in_order(TX40), asked, strict=True))
        return
    name = TX40.joint[wrong].name
    with pytest.raises(
        SessionError, match=rf"^stage first move: {name} did not go the way .*sign of its drive"
    ):
        stage()
    assert f"Did {name} go first" in asked[-1] and len(asked) == 1 + in_order(TX40).index(wrong)


@pytest.mark.parametrize(("factor", "measured"), [(1.0, False), (2.5, False), (2.5, True)])
def test_a_gain_that_the_drive_contradicts_ends_the_stage_before_torque(
    factor: float, measured: bool
) -> None:
    arm = right_arm(TX40, 4)
    wrong = drive(2, "gain", factor)(arm).wrong
    reports = [
        SimpleNamespace(joint=joint.name, settings={"6076": int(rated)})
        for joint, rated in zip(TX40.joint, arm.rated, strict=True)
    ]
    asked: list[str] = []

    def looked(question: str) -> bool:
        asked.append(question)
        return measured

    open_arm: Any = SimpleNamespace(session=SimpleNamespace(robot=wrong, drives=reports))
    if factor == 1.0 or measured:
        first_stage.refuse_doubtful_gains(open_arm, looked)
    else:
        with pytest.raises(SessionError, match=r"stage first move: drive\[3\] \(joint_3\): .*\(6076\)"):
            first_stage.refuse_doubtful_gains(open_arm, looked)
    assert [question.split(":")[0] for question in asked] == ["drive[3] (joint_3)"] * (factor != 1.0)


def test_half_a_degree_that_has_no_room_is_refused(tmp_path: object) -> None:
    from daq.session.cell import cell_of

    cell = Path(str(tmp_path)) / "cell.toml"
    cell.write_text("format = 1\nfloor = 0.55\n", encoding="utf-8")
    motion = half_degree(TX40, np.array(TX40.home), range(6))
    refuse_in_the_way(TX40, motion, Cell())
    with pytest.raises(SessionError, match=r"^stage first move: there is no room for half a degree"):
        refuse_in_the_way(TX40, motion, cell_of(cell))
