"""The page of a plan: whole in one file, every joint and limit on it, the surroundings in the pictures."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.planning.arm_picture import arm_bodies, outline
from daq.planning.plan_pictures import PATH_WIDTH, limit_panel, path_view
from robots import Robot
from tests.daq.planning.conftest import Plan
from trajectories import Obstacle, ToolSpeed
from trajectories.constraints.torque import TorqueCheck
from trajectories.limits import Limits
from trajectories.motions.motion import MotionState


class Tags(HTMLParser):
    """Which tags are open, and what links out of the page."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.outside: list[str] = []
        self.headings: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        for name, value in attrs:
            if name in {"src", "href"} and value and not value.startswith("#"):
                self.outside.append(value)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Nothing is left open."""

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_whole_and_needs_nothing_else(plan: Plan, tmp_path: Path) -> None:
    plan("emps", "--floor", "-1", "--out", "mine", "--periods", 2)
    text = (tmp_path / "mine" / "plan.html").read_text(encoding="utf-8")
    tags = Tags()
    tags.feed(text)
    assert tags.open == [] and tags.outside == []
    for what in (
        "May be driven",
        "expected torque, N",
        "position, m",
        "2 periods of 4 s",
        "From the front: y right, z up",
        "Use of each limit",
        "floor at -1 m",
        "Fc1",
    ):
        assert what in text, what


def test_a_refused_motion_says_so_at_the_top(plan: Plan, tmp_path: Path) -> None:
    plan("emps", "--out", "mine")
    assert (
        plan("emps", "--check", "mine/emps.trajectory.json", "--tool-speed", 0.01, "--out", "bad").code == 2
    )
    text = (tmp_path / "bad" / "plan.html").read_text(encoding="utf-8")
    top = text.split("Joints against their limits", 1)[0]
    assert "Must not be driven" in top and "carriage: tool speed of table reaches" in top


def test_a_curve_beyond_its_limit_is_marked_and_stays_in_its_panel() -> None:
    time = np.linspace(0.0, 1.0, 50)
    inside, beyond = (limit_panel("q", time, a * np.sin(6 * time), -1.0, 1.0, 60) for a in (0.9, 1.5))
    assert not inside.breaks and beyond.breaks
    assert inside.limits[0] > beyond.limits[0] > 50.0 > beyond.limits[1] > inside.limits[1] > 0.0


def points_of(style: str, picture: str) -> NDArray[np.float64]:
    """Corners (N × 2) of the first path of a style."""
    found = re.search(rf'class="{style}" d="M([^Z"]*)', picture)
    assert found is not None
    return np.array([[float(value) for value in pair.split()] for pair in found[1].split("L")])


@pytest.mark.parametrize("axes", [(0, 1), (0, 2), (1, 2)])
def test_surroundings_that_are_near_are_in_the_picture_with_their_names(axes: tuple[int, int]) -> None:
    angle = np.linspace(0.0, 6.0, 100)
    path = np.column_stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), 0.6 + 0.2 * np.sin(3 * angle)])
    box = Obstacle("<table>", (0.0, 0.8, 0.1), (0.6, 0.3, 0.4), 0.3)
    far = Obstacle("wall", (50.0, 50.0, 50.0), (1.0, 1.0, 1.0))
    view = path_view("view", axes, path, path[3], (box, far), -0.3)
    height = int(re.search(rf'viewBox="0 0 {PATH_WIDTH} (\d+)"', view.picture)[1])  # type: ignore[index]
    assert "&lt;table&gt;" in view.picture and "<table>" not in view.picture
    corners, way = points_of("box", view.picture), points_of("way", view.picture)
    shown = (corners >= -5).all(axis=1) & (corners <= [PATH_WIDTH + 5, height + 5]).all(axis=1)
    assert shown.any()
    assert (way >= 0).all() and (way <= [PATH_WIDTH, height]).all()
    assert ("floor" in view.picture) == (axes[1] == 2)


def test_the_expected_torque_is_that_of_the_arms_own_regressor(tx40: Robot) -> None:
    from ident import RegressorModel, base_parameters
    from ident.effects import State

    generator = np.random.default_rng(0)
    position, velocity, acceleration = generator.uniform(-1, 1, (3, 60, 6))
    # Near standstill dry friction is a matter of definition.
    moving = (np.abs(velocity @ tx40.transmission_matrix.T) > 0.1).all(axis=1) & (np.abs(velocity) > 0.1).all(
        axis=1
    )
    position, velocity, acceleration = (x[moving] for x in (position, velocity, acceleration))
    assert len(position) > 10
    base = base_parameters(RegressorModel.of(tx40))
    expected = base.columns(State(position, velocity, acceleration)) @ base.regroup(base.model.prior())
    state = MotionState(position, velocity, acceleration, np.zeros_like(position))
    torque = TorqueCheck.of(tx40, Limits.of(tx40)).torque(state)
    np.testing.assert_allclose(torque, expected, atol=1e-6)


def test_the_arm_is_drawn_where_its_bodies_are(tx40: Robot, emps: Robot) -> None:
    # One axis: the carriage is a box of 0.2 m in x that goes with the joint, the bench stays.
    (bench, carriage), (bench_there, carriage_there) = (
        sorted(arm_bodies(emps, np.array([q])), key=lambda body: -np.ptp(body[:, 0])) for q in (0.1, 0.15)
    )
    np.testing.assert_allclose(bench, bench_there)
    np.testing.assert_allclose(carriage_there - carriage, np.tile([0.05, 0.0, 0.0], (len(carriage), 1)))
    assert np.ptp(carriage[:, 0]) == pytest.approx(0.2) and np.ptp(bench[:, 0]) == pytest.approx(0.9)
    # Six axes: the last body is around the origin of the last link, from whichever side.
    posture = np.array([0.3, -0.4, 0.9, 0.2, 0.7, -0.1])
    tool = ToolSpeed(tx40).path(posture[np.newaxis])[0]
    bodies = arm_bodies(tx40, posture)
    assert len(bodies) == 9
    assert min(float(np.linalg.norm(body.mean(axis=0) - tool)) for body in bodies) < 0.1
    for axes in ((0, 1), (0, 2), (1, 2)):
        for body in bodies:
            corners = outline(body[:, axes])
            np.testing.assert_allclose(np.ptp(corners, axis=0), np.ptp(body[:, axes], axis=0))
    flat = outline(np.array([[0.0, 0.0], [1.0, 1.0], [0.5, 0.5]]))  # a plate seen from its edge
    np.testing.assert_allclose(flat, [[0.0, 0.0], [1.0, 1.0]])


def test_the_arm_is_on_the_page_at_the_start_and_where_its_tool_is_fastest(
    plan: Plan, tmp_path: Path
) -> None:
    plan("emps", "--out", "mine", "--floor", "-1")
    text = (tmp_path / "mine" / "plan.html").read_text(encoding="utf-8")
    assert text.count('<path class="arm" ') == text.count('<path class="arm there" ') == 3 * 2
    assert "the arm at the start" in text
