"""Motions of a session keep clear of what stands in the cell."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from daq.session.admission import SIMULATED
from daq.session.bench import OpenArm
from daq.session.cell import Cell, cell_of
from daq.session.commission import Walk
from daq.session.dry_run import CommissionRequest, Planned
from daq.session.motions import move_to, refuse_undrivable
from daq.session.recorded_runs import unconducted
from daq.session.run import way_to
from daq.session.session_error import SessionError
from daq.session.warm_up import warm_up
from daq.session.watching import Nobody
from daq.text.progress import Silent
from drivers import Channel
from robots import Robot
from robots.arrays import FloatArray
from tests.daq.session.motions import order
from trajectories import Trajectory, TrajectoryError, approach

POST = """
format = 1
floor = -0.1

[[obstacle]]
name = "post"
centre = [0.45, 0.0, 0.25]
size = [0.14, 0.1, 0.8]
"""
BESIDE = np.array([-1.0, 0.6, 1.2, 0.0, 0.3, 0.0])
"""The forearm stretched out on one side of the post."""
ACROSS = BESIDE * [-1.0, 1, 1, 1, 1, 1]


@dataclass
class Standing:
    """A session with an arm that stands somewhere."""

    robot: Robot
    posture: FloatArray

    def actual_position(self) -> FloatArray:
        return self.posture


def standing(robot: Robot, posture: FloatArray) -> OpenArm:
    return OpenArm(
        cast("Any", Standing(robot, posture)), cast("Any", None), SIMULATED, Channel("virtual", "standing")
    )


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    path = tmp_path / "cell.toml"
    path.write_text(POST, encoding="utf-8")
    return cell_of(path)


def problems(cell: Cell, robot: Robot, motion: Trajectory) -> str:
    start = np.asarray(motion.position[0])
    found = cell.conditions.judge(robot, start=start).judge(motion.motion).problems
    return "; ".join(map(str, found))


def test_a_cell_is_known_by_what_it_says(cell: Cell, tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    assert cell.words == f"{path}: floor at -0.1 m, post"
    path.write_text(POST + "# measured again\n", encoding="utf-8")
    assert cell_of(path).sha256 == cell.sha256 != "", "a comment is no other cell"
    moved = re.sub(r"\d+\.\d+", lambda found: f"{float(found.group()) + 0.01:g}", POST, count=1)
    path.write_text(moved, encoding="utf-8")
    assert cell_of(path).sha256 != cell.sha256
    assert cell_of(None) == Cell() and Cell().sha256 == ""


def test_the_way_to_the_start_goes_around_the_post(tx40: Robot, cell: Cell) -> None:
    arm = standing(tx40, BESIDE)
    straight = move_to(arm, ACROSS)
    assert straight is not None and "post" in problems(cell, tx40, straight), "the post is in the way"
    around = move_to(arm, ACROSS, cell)
    assert around is not None and problems(cell, tx40, around) == ""
    assert (
        np.abs(around.position[0] - BESIDE).max() < 1e-9 and np.abs(around.position[-1] - ACROSS).max() < 1e-9
    )
    assert around.duration > straight.duration
    trajectory = approach(tx40, ACROSS, np.array(tx40.home), tx40.bus.cycle_time)
    way = way_to(arm, trajectory, cell, allowed=True)
    assert way is not None and np.array_equal(way.position, around.position)


def test_a_trajectory_through_the_post_is_refused(tx40: Robot, cell: Cell, tmp_path: Path) -> None:
    through = approach(tx40, BESIDE, ACROSS, tx40.bus.cycle_time)
    refuse_undrivable(tx40, through, tmp_path / "motion.json")
    with pytest.raises(SessionError, match=r"motion.json: must not be driven: .*post"):
        refuse_undrivable(tx40, through, tmp_path / "motion.json", cell)


def test_no_stage_of_commissioning_touches_the_post(tx40: Robot, cell: Cell, tmp_path: Path) -> None:
    """Approach, warm-up and return of an arm that stands beside it, and begins on its other side."""
    trajectory = approach(tx40, ACROSS, np.array(tx40.home), tx40.bus.cycle_time)

    def motions(cell: Cell, posture: FloatArray) -> dict[str, Trajectory]:
        request = CommissionRequest(order(tx40, Channel("virtual", "x"), "tx40"), tmp_path, cell=cell)
        planned = Planned(tmp_path / "motion.json", "", trajectory, (), {})
        walk = Walk(request, planned, standing(tx40, posture), Silent(), Nobody(), unconducted)
        found = {name: walk.motion(name) for name in ("approach", "warm-up", "return")}
        return {name: motion for name, motion in found.items() if motion is not None}

    assert set(motions(Cell(), BESIDE)) == {"approach", "warm-up", "return"}
    for name, motion in motions(cell, BESIDE).items():
        assert problems(cell, tx40, motion) == "", name
    assert "post" in problems(cell, tx40, motions(Cell(), BESIDE)["approach"])


def test_the_warm_up_turns_to_the_free_side(tx40: Robot, tmp_path: Path) -> None:
    """A wall on the side to which a joint would go: it goes to the other one."""
    posture = BESIDE * [0.0, 1, 1, 1, 1, 1]
    free = warm_up(tx40, posture).position[:, 0]
    towards = 1.0 if free.max() > 1e-3 else -1.0
    path = tmp_path / "cell.toml"
    y = towards * 0.29
    path.write_text(
        f'format = 1\n[[obstacle]]\nname = "wall"\ncentre = [0.62, {y}, 0.45]\nsize = [0.6, 0.3, 0.6]\n',
        encoding="utf-8",
    )
    beside = warm_up(tx40, posture, cell_of(path)).position[:, 0]
    assert np.abs(beside).max() > 1e-3 and np.sign(beside[np.argmax(np.abs(beside))]) == -towards


def test_an_arm_that_touches_something_does_not_move(tx40: Robot, tmp_path: Path) -> None:
    path = tmp_path / "cell.toml"
    path.write_text(
        'format = 1\n[[obstacle]]\nname = "shelf"\ncentre = [0.25, -0.3, 0.45]\nsize = [0.2, 0.2, 0.2]\n',
        encoding="utf-8",
    )
    with pytest.raises(TrajectoryError, match="shelf"):
        move_to(standing(tx40, BESIDE), np.array(tx40.home), cell_of(path))
