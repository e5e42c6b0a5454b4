"""An arm that is not as described is found out before torque, at rest, by a touch or by half a degree."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from daq.session.cell import Cell
from daq.session.first_judgement import described_gravity, judge_rest
from daq.session.first_motion import HALF_DEGREE, half_degree, refuse_in_the_way, touch
from daq.session.session_error import SessionError
from tests.daq.session.wrong_arms import WrongArm
from tests.daq.session.wrong_descriptions import SINGLE, Slip, before_torque, pairs, right_arm

TX40 = robots.load("tx40")
UNSEEN = ("zero of drive", "nodes 3 and 5 swapped", "nodes 5 and 6 swapped")
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
    if not before:
        assert arm.findings and all(finding.joint.startswith("joint_") for finding in arm.findings)


@pytest.mark.slow
@pytest.mark.parametrize(
    "slip", [case for case in SINGLE if not case[0].startswith(UNSEEN)], ids=lambda s: s[0]
)
def test_physics_alone_catches_it_too(slip: Slip) -> None:
    """Where the arm stands at its zero, or the drive has no 608F, nothing before torque would."""
    arm = slip[1](right_arm(TX40, 7))
    assert arm.first_contact() in ("at rest", "by a touch", "by half a degree")
    assert np.degrees(arm.farthest) < 1.0
    if slip[0].startswith("sign"):
        assert any("the sign is likely wrong" in finding.text for finding in arm.findings)


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


def test_half_a_degree_that_has_no_room_is_refused(tmp_path: object) -> None:
    from pathlib import Path

    from daq.session.cell import cell_of

    cell = Path(str(tmp_path)) / "cell.toml"
    cell.write_text("format = 1\nfloor = 0.55\n", encoding="utf-8")
    motion = half_degree(TX40, np.array(TX40.home), range(6))
    refuse_in_the_way(TX40, motion, Cell())
    with pytest.raises(SessionError, match=r"^stage first move: there is no room for half a degree"):
        refuse_in_the_way(TX40, motion, cell_of(cell))
