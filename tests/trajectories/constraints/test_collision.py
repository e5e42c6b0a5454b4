"""Distances along a motion: proven between samples, and refused by name where something is in the way."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots import load
from trajectories import (
    CollisionCheck,
    Conditions,
    Obstacle,
    PlanError,
    Surroundings,
    TrajectoryError,
    approach,
    plan,
)
from trajectories.limits import Limits, Margins
from trajectories.motions.segments import PiecewiseJerk, SegmentPlanner, Waypoint

CELL = Surroundings(floor=0.0, obstacles=(Obstacle("wall", (0.55, 0.0, 0.5), (0.1, 2.0, 1.0)),))


@pytest.fixture(scope="module")
def check() -> CollisionCheck:
    return CollisionCheck(load("tx40"), CELL)


def random_segment(seed: int) -> PiecewiseJerk:
    generator = np.random.default_rng(seed)
    limits = Limits.of(load("tx40"), Margins(position=0.0))
    while True:
        start, goal = (
            Waypoint(generator.uniform(limits.lower, limits.upper) * 0.8, np.zeros(6), np.zeros(6))
            for _ in range(2)
        )
        part = SegmentPlanner(limits).connect(start, goal)
        if part is not None:
            return part


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_the_nearest_distance_is_that_of_dense_sampling_and_is_proven(seed: int) -> None:
    check = CollisionCheck(load("tx40"), CELL)
    motion = random_segment(seed)
    dense = motion.at(np.linspace(0.0, motion.duration, 1500)).position
    smallest = min(float(check.distances(posture).min()) for posture in dense)
    nearest = check.nearest(motion)
    assert nearest is not None
    assert nearest.at_least <= smallest + 1e-9
    assert nearest.distance == pytest.approx(smallest, abs=2e-3)
    assert nearest.distance - nearest.at_least <= 1.1e-3
    assert check.allows(motion) == (smallest >= CELL.clearance) or abs(smallest - CELL.clearance) < 2e-3


def test_neighbours_and_the_links_of_a_wrist_are_not_watched(check: CollisionCheck) -> None:
    bodies = {frozenset(name for name in pair) for pair in check.pairs}
    for pair in ({"link_2", "link_3"}, {"link_4", "link_5"}, {"link_4", "link_6"}, {"base_link", "link_1"}):
        assert frozenset(pair) not in bodies
    for pair in ({"base_link", "link_4"}, {"link_1", "link_6"}, {"link_2", "link_4"}):
        assert frozenset(pair) in bodies


def test_surroundings_add_their_own_pairs() -> None:
    robot = load("tx40")
    alone = CollisionCheck(robot, Surroundings()).pairs
    nothing = CollisionCheck(robot, Surroundings(itself=False)).pairs
    floor = CollisionCheck(robot, Surroundings(floor=0.0, itself=False)).pairs
    assert nothing == ()
    assert len(alone) > 10
    assert {second for _, second in floor} == {"floor"} and "base_link" not in {first for first, _ in floor}


def test_where_nothing_is_watched_everything_is_allowed() -> None:
    check = CollisionCheck(load("tx40"), Surroundings(itself=False))
    assert check.nearest(random_segment(1)) is None
    assert check.allows(random_segment(1))


def test_it_works_in_another_process(check: CollisionCheck) -> None:
    posture = np.array(load("tx40").home)
    copy = pickle.loads(pickle.dumps(check))
    np.testing.assert_array_equal(copy.distances(posture), check.distances(posture))


def test_a_move_into_the_wall_is_refused_by_name() -> None:
    robot = load("tx40")
    goal = [0.0, 1.57, 0.0, 0.0, 0.0, 0.0]
    into_wall = r"^joint_\d: goal puts link_\d \d+\.\d mm into wall; allowed: 10\.0 mm apart$"
    with pytest.raises(TrajectoryError, match=into_wall) as refused:
        approach(robot, robot.home, goal, 0.004, surroundings=CELL)
    assert refused.value.constraint == "collision"
    assert refused.value.joint.startswith("joint_")
    motion = approach(robot, robot.home, goal, 0.004).motion
    through = r"^joint_\d: the motion (brings|puts) link_\d .* wall at t = \d\.\d+ s; allowed: 10\.0 mm"
    with pytest.raises(TrajectoryError, match=through) as refused:
        CollisionCheck(robot, CELL).require(motion)
    assert refused.value.time is not None and 0.0 < refused.value.time <= motion.duration
    assert approach(robot, robot.home, goal, 0.004).detail.nearest is not None


def test_a_plan_keeps_its_clearance_from_floor_wall_and_itself(check: CollisionCheck) -> None:
    conditions = Conditions(surroundings=CELL)
    trajectory = plan(
        load("tx40"), cycle_time=0.004, duration=8.0, seed=1, evaluations=300, conditions=conditions
    )
    dense = trajectory.at(np.arange(0.0, trajectory.duration, 0.004)).position
    assert min(check.distances(posture).min() for posture in dense) >= CELL.clearance - 1e-9
    assert trajectory.detail.nearest is not None
    assert trajectory.detail.nearest.distance >= CELL.clearance


def test_a_start_in_collision_is_named() -> None:
    start = [0.0, 2.1, 0.9, 0.0, 0.0, 0.0]
    into = r"^joint_\d: start puts link_\d \d+\.\d mm into .*; allowed: 10\.0 mm apart$"
    with pytest.raises(PlanError, match=into) as refused:
        plan(
            load("tx40"),
            cycle_time=0.004,
            duration=8.0,
            seed=1,
            start=start,
            conditions=Conditions(surroundings=CELL),
        )
    assert refused.value.constraint == "collision"


def test_a_box_without_size_and_a_clearance_of_nothing_are_refused() -> None:
    with pytest.raises(TrajectoryError, match=r"^obstacle post has size .*; allowed: edges above 0 m$"):
        Obstacle("post", (0.0, 0.0, 0.0), (1.0, 0.0, 1.0))
    with pytest.raises(TrajectoryError, match=r"^clearance is 0\.0 m; allowed: above 0$"):
        Surroundings(clearance=0.0)
