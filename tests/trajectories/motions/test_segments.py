"""Segments of constant jerk: continuous, exact, and never outside their limits."""

from __future__ import annotations

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from robots.arrays import FloatArray
from trajectories.limits import Limits
from trajectories.motions.motion import MotionSequence
from trajectories.motions.segments import PiecewiseJerk, SegmentPlanner, Waypoint, hold, join

seeds = st.integers(0, 2**32 - 1)


def random_limits(generator: np.random.Generator, n: int) -> Limits:
    scale = 10.0 ** generator.uniform(-1, 1, n)
    return Limits(
        names=tuple(f"joint_{k + 1}" for k in range(n)),
        lower=-scale,
        upper=scale * generator.uniform(0.3, 3.0, n),
        velocity=scale * generator.uniform(0.2, 2.0, n),
        acceleration=scale * generator.uniform(2.0, 30.0, n),
        jerk=scale * generator.uniform(20.0, 1000.0, n),
        torque=np.ones(n),
        drive_torque=np.ones(n),
    )


def random_waypoint(generator: np.random.Generator, limits: Limits) -> Waypoint:
    return Waypoint(
        generator.uniform(limits.lower, limits.upper),
        generator.uniform(-1, 1, limits.n) * limits.velocity * generator.choice([0.2, 0.6, 1.0]),
        np.zeros(limits.n),
    )


def chain_of_one_seed() -> list[PiecewiseJerk]:
    return next(parts for parts in (random_chain(seed)[2] for seed in range(100)) if len(parts) == 4)


def random_chain(seed: int) -> tuple[Limits, list[Waypoint], list[PiecewiseJerk]]:
    """A few segments through random waypoints of a random arm, some slowed down, some joints at rest."""
    generator = np.random.default_rng(seed)
    limits = random_limits(generator, int(generator.integers(1, 8)))
    planner = SegmentPlanner(limits)
    waypoints = [random_waypoint(generator, limits)]
    parts: list[PiecewiseJerk] = []
    for _ in range(60):
        goal = random_waypoint(generator, limits)
        if generator.random() < 0.3:
            goal = Waypoint.at_rest(goal.position)
        part = planner.connect(waypoints[-1], goal)
        if part is not None and generator.random() < 0.3:
            part = planner.connect(waypoints[-1], goal, part.duration * 1.5)
        if part is not None:
            parts.append(part)
            waypoints.append(goal)
        if len(parts) == 4:
            break
    return limits, waypoints, parts


@given(seeds, st.floats(0.0005, 0.02))
@settings(max_examples=60, deadline=None)
def test_no_limit_is_exceeded_twenty_times_denser_than_the_cycle(seed: int, cycle_time: float) -> None:
    limits, _, parts = random_chain(seed)
    if not parts:
        return
    motion = join(parts)
    dense = motion.at(np.arange(0.0, motion.duration + cycle_time, cycle_time / 20)[:200_000])
    room = 1e-6 * (limits.upper - limits.lower)
    assert (dense.position >= limits.lower - room).all() and (dense.position <= limits.upper + room).all()
    assert (np.abs(dense.velocity) <= limits.velocity * (1 + 1e-6)).all()
    assert (np.abs(dense.acceleration) <= limits.acceleration * (1 + 1e-6)).all()
    assert (np.abs(dense.jerk) <= limits.jerk * (1 + 1e-6)).all()


@given(seeds)
@settings(max_examples=60, deadline=None)
def test_extremes_bound_every_state_and_are_reached(seed: int) -> None:
    _, _, parts = random_chain(seed)
    if not parts:
        return
    motion = join(parts)
    extremes = motion.extremes()
    dense = motion.at(np.linspace(0.0, motion.duration, 20_001))
    size = np.abs(dense.position).max(axis=0) + 1.0
    assert (dense.position.max(axis=0) <= extremes.highest + 1e-9 * size).all()
    assert (dense.position.min(axis=0) >= extremes.lowest - 1e-9 * size).all()
    assert (np.abs(dense.velocity).max(axis=0) <= extremes.velocity + 1e-9 * size).all()
    for joint in range(motion.joints):
        highest = motion.at(extremes.highest_time[[joint]]).position[0, joint]
        assert highest == pytest.approx(extremes.highest[joint], abs=1e-8 * size[joint])
        fastest = motion.at(extremes.velocity_time[[joint]]).velocity[0, joint]
        assert abs(fastest) == pytest.approx(extremes.velocity[joint], rel=1e-7)
    lowest, highest = motion.travel()
    np.testing.assert_allclose(lowest, extremes.lowest, atol=1e-12 * size.max())
    np.testing.assert_allclose(highest, extremes.highest, atol=1e-12 * size.max())


@given(seeds)
@settings(max_examples=60, deadline=None)
def test_position_velocity_acceleration_are_continuous_across_segments(seed: int) -> None:
    limits, waypoints, parts = random_chain(seed)
    for part, before, after in zip(parts, waypoints, waypoints[1:], strict=False):
        first, last = (part.at(np.array([t])) for t in (0.0, part.duration))
        for state, waypoint in ((first, before), (last, after)):
            for name, unit in (
                ("position", limits.upper - limits.lower),
                ("velocity", limits.velocity),
                ("acceleration", limits.acceleration),
            ):
                gap = np.abs(getattr(state, name)[0] - getattr(waypoint, name)) / unit
                assert gap.max() < 1e-6, name


def test_derivatives_are_those_of_the_position() -> None:
    motion = join(chain_of_one_seed())
    step = 1e-4
    time = np.linspace(0.05, motion.duration - 0.05, 500)
    here = motion.at(time)
    for name, derivative in (("position", "velocity"), ("velocity", "acceleration")):
        ahead, behind = (getattr(motion.at(time + sign * step), name) for sign in (1, -1))
        np.testing.assert_allclose(
            (ahead - behind) / (2 * step),
            getattr(here, derivative),
            rtol=0,
            atol=2 * step * np.abs(here.jerk).max(),
        )


def test_states_agree_with_ruckig() -> None:
    generator = np.random.default_rng(11)
    limits = random_limits(generator, 5)
    planner = SegmentPlanner(limits)
    part = None
    while part is None:
        start, goal = (random_waypoint(generator, limits) for _ in range(2))
        part = planner.connect(start, goal)
    request = ruckig.InputParameter(5)
    request.current_position, request.current_velocity = start.position, start.velocity
    request.target_position, request.target_velocity = goal.position, goal.velocity
    request.max_velocity, request.max_acceleration = limits.velocity, limits.acceleration
    request.max_jerk = limits.jerk
    reference = ruckig.Trajectory(5)
    ruckig.Ruckig(5).calculate(request, reference)
    time = np.linspace(0.0, part.duration, 333)[1:-1]
    state = part.at(time)
    expected = [reference.at_time(t)[:3] for t in time]
    for k, name in enumerate(("position", "velocity", "acceleration")):
        np.testing.assert_allclose(getattr(state, name), [e[k] for e in expected], atol=1e-9)


def overshooting(planner: SegmentPlanner) -> PiecewiseJerk | None:
    """Joint 1 must turn round outside the travel because it is already fast; joint 2 makes it wait."""
    start = Waypoint(np.array([0.9, 0.0]), np.array([1.0, 0.0]), np.zeros(2))
    goal = Waypoint(np.array([0.0, 3.0]), np.array([0.0, 0.0]), np.zeros(2))
    return planner.connect(start, goal)


def test_a_segment_that_leaves_the_travel_on_its_way_is_refused() -> None:
    def limits(upper: float) -> Limits:
        ones: FloatArray = np.ones(2)
        bounds = np.array([upper, 5.0])
        return Limits(("a", "b"), -bounds, bounds, 2 * ones, 4 * ones, 40 * ones, ones, ones)

    assert overshooting(SegmentPlanner(limits(1.0))) is None
    assert overshooting(SegmentPlanner(limits(2.0))) is not None


def test_a_sequence_of_motions_is_the_parts_one_after_the_other() -> None:
    parts = chain_of_one_seed()
    sequence, joined = MotionSequence(tuple(parts)), join(parts)
    time = np.linspace(0.0, joined.duration, 777)
    for name in ("position", "velocity", "acceleration", "jerk"):
        np.testing.assert_allclose(
            getattr(sequence.at(time), name), getattr(joined.at(time), name), atol=1e-9
        )
    for name in ("lowest", "highest", "velocity", "acceleration", "jerk"):
        np.testing.assert_allclose(getattr(sequence.extremes(), name), getattr(joined.extremes(), name))


def test_hold_stands_still() -> None:
    still = hold(np.array([0.3, -1.0]), 2.0)
    state = still.at(np.array([0.0, 1.0, 5.0]))
    np.testing.assert_array_equal(state.position, [[0.3, -1.0]] * 3)
    assert not state.velocity.any() and not state.acceleration.any()


def test_a_distance_on_the_edge_of_two_of_ruckigs_cases_is_still_driven() -> None:
    ones = np.ones(1)
    limits = Limits(("a",), -2 * ones, 2 * ones, 6.7536 * ones, 20 * ones, 400 * ones, ones, ones)
    start, goal = (Waypoint.at_rest(np.array([x])) for x in (1.6707, 1.5707))
    part = SegmentPlanner(limits).connect(start, goal)
    assert part is not None
    assert part.at(np.array([part.duration])).position[0, 0] == pytest.approx(1.5707, abs=1e-9)
