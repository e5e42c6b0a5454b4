"""Planning as a user does it: what comes out keeps every limit, repeats exactly, and says why it cannot."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ident.effects import State
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from robots import load
from robots.description import Robot
from trajectories import Conditions, Objective, PlanError, Tool, Trajectory, plan
from trajectories.limits import Limits


def small_plan(robot: Robot, **changes: object) -> Trajectory:
    arguments: dict[str, object] = {"cycle_time": 0.004, "duration": 6.0, "seed": 1, "evaluations": 150}
    return plan(robot, **(arguments | changes))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def planned() -> Trajectory:
    return small_plan(load("tx40"), duration=12.0, evaluations=1000)


def scaled(robot: Robot, seed: int) -> Robot:
    """The same arm with other limits."""
    generator = np.random.default_rng(seed)
    joints = []
    for joint, home in zip(robot.joint, robot.home, strict=True):
        low, high = joint.position
        share = generator.uniform(0.2, 1.0, 2)
        joints.append(
            joint.model_copy(
                update={
                    "position": (home + share[0] * (low - home), home + share[1] * (high - home)),
                    "velocity": joint.velocity * generator.uniform(0.2, 1.5),
                    "acceleration": joint.acceleration * generator.uniform(0.3, 1.2),
                    "jerk": joint.jerk * generator.uniform(0.1, 3.0),
                }
            )
        )
    return robot.model_copy(update={"joint": tuple(joints)})


def test_it_starts_and_ends_at_rest_at_home(planned: Trajectory) -> None:
    home = load("tx40").home
    np.testing.assert_allclose(planned.position[[0, -1]], [home, home], atol=1e-9)
    assert np.abs(planned.velocity[[0, -1]]).max() < 1e-9
    assert np.abs(planned.acceleration[[0, -1]]).max() < 1e-9
    assert planned.time[-1] == pytest.approx(12.0)
    np.testing.assert_allclose(np.diff(planned.time), 0.004)


def test_its_figures_are_those_of_its_samples(planned: Trajectory) -> None:
    robot = load("tx40")
    rows = base_parameters(RegressorModel.of(robot)).columns(
        State(planned.position, planned.velocity, planned.acceleration)
    )
    rows = rows * fast_samples(robot, planned)[:, :, np.newaxis]
    weighted = (rows / np.array([joint.torque_noise for joint in robot.joint])[:, np.newaxis]).reshape(
        -1, rows.shape[2]
    )
    assert planned.detail.condition == pytest.approx(np.linalg.cond(weighted), rel=0.05)
    covariance = np.linalg.inv(weighted.T @ weighted) * 2.5
    assert planned.detail.trace == pytest.approx(np.trace(covariance), rel=0.06)
    assert planned.detail.condition < 250


def fast_samples(robot: Robot, trajectory: Trajectory) -> NDArray[np.bool_]:
    """samples × joints: no standstill of the joint or of a drive that moves with it within the margin."""
    settings, cycle = robot.identification, trajectory.cycle_time
    reach = round(settings.standstill_margin / cycle)
    speeds = [trajectory.velocity, trajectory.velocity @ robot.transmission_matrix.T]
    fast = np.ones(trajectory.velocity.shape, dtype=np.bool_)
    for k in range(len(fast)):
        around = slice(max(0, k - reach), k + reach + 1)
        joint, drive = (
            (np.abs(v[around]) > settings.minimum_speed * robot.velocity_limits).all(0) for v in speeds
        )
        for j in range(robot.n):
            moved_by = [d for d in range(robot.n) if robot.transmission[d][j] != 0.0]
            fast[k, j] = joint[j] and all(drive[d] for d in moved_by)
    start, end = settings.trim_samples
    fast[:start] = fast[len(fast) - end :] = False
    return fast


def test_a_longer_search_is_a_better_one(planned: Trajectory) -> None:
    assert planned.score < small_plan(load("tx40"), duration=12.0, evaluations=50).score - 0.2


def test_every_joint_has_slow_and_fast_passes_both_ways(planned: Trajectory) -> None:
    speed = planned.velocity / load("tx40").velocity_limits
    for joint in range(6):
        moving = speed[np.abs(speed[:, joint]) > 0.005, joint]
        assert np.abs(moving).max() > 0.3 and np.quantile(np.abs(moving), 0.2) < 0.2
        assert moving.max() > 0.2 and moving.min() < -0.2


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0005, 0.001, 0.002, 0.004, 0.01]))
@settings(max_examples=10, deadline=None)
def test_no_limit_is_exceeded_for_random_arms_and_cycles(seed: int, cycle_time: float) -> None:
    robot = scaled(load("tx40" if seed % 3 == 0 else "emps"), seed)
    trajectory = small_plan(robot, seed=seed, cycle_time=cycle_time, duration=8.0, evaluations=60)
    limits = Limits.of(robot)
    dense = trajectory.at(np.arange(0.0, trajectory.duration, cycle_time / 20))
    room = 1e-6 * (limits.upper - limits.lower)
    assert (dense.position >= limits.lower - room).all() and (dense.position <= limits.upper + room).all()
    for name in ("velocity", "acceleration", "jerk"):
        assert (np.abs(getattr(dense, name)) <= getattr(limits, name) * (1 + 1e-6)).all(), name
    assert all((use.share <= 1 + 1e-6).all() for use in trajectory.detail.uses)
    for ahead, behind in itertools.pairwise((trajectory.position[1:], trajectory.position[:-1])):
        assert (np.abs(ahead - behind) <= limits.velocity * cycle_time * (1 + 1e-6)).all()


def test_a_seed_repeats_exactly_and_another_differs() -> None:
    robot = load("emps")
    first, again, other = (small_plan(robot, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.position, again.position)
    assert first.score == again.score
    assert not np.array_equal(first.position, other.position)


@pytest.mark.slow
def test_workers_do_not_change_the_result() -> None:
    robot = load("emps")
    one, two = (small_plan(robot, searches=2, workers=workers) for workers in (1, 2))
    np.testing.assert_array_equal(one.position, two.position)


def test_progress_runs_from_nothing_to_all_and_the_score_never_rises() -> None:
    seen: list[tuple[float, float]] = []
    small_plan(load("emps"), evaluations=600, progress=lambda share, score: seen.append((share, score)))
    shares, scores = zip(*seen, strict=True)
    assert shares[0] == 0.0 and shares[-1] == 1.0 and list(shares) == sorted(shares)
    assert list(scores) == sorted(scores, reverse=True)


def test_a_stopped_search_hands_over_what_it_has() -> None:
    calls = itertools.count()
    trajectory = small_plan(load("emps"), evaluations=10**6, stop=lambda: next(calls) >= 2)
    assert 0 < trajectory.detail.evaluations < 1000
    assert np.isfinite(trajectory.score)


def test_it_starts_where_the_arm_is() -> None:
    robot = load("tx40")
    start = np.add(robot.home, (0.3, -0.2, 0.1, 0.5, -0.4, 1.0))
    trajectory = small_plan(robot, start=start, periods=2)
    np.testing.assert_allclose(trajectory.position[0], start, atol=1e-9)
    np.testing.assert_allclose(trajectory.position[-1], robot.home, atol=1e-9)
    repeat = trajectory.repeat
    assert repeat is not None and repeat.count == 2 and repeat.period == pytest.approx(6.0)
    there = trajectory.at(np.array([repeat.start]))
    np.testing.assert_allclose(there.position[0], robot.home, atol=1e-9)
    assert trajectory.duration == pytest.approx(repeat.start + 12.0)
    slow = trajectory.at(np.linspace(0.0, repeat.start, 200))
    assert (np.abs(slow.velocity) <= 0.9 * 0.3 * robot.velocity_limits + 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize("family", ["ruckig", "fourier"])
def test_a_first_run_is_the_same_path_more_slowly(family: str) -> None:
    robot = load("tx40")
    settings = {"family": family, "periods": 2, "duration": 8.0, "evaluations": 40}
    full, slow = small_plan(robot, **settings), small_plan(robot, **settings, speed=0.25)
    speed = slow.speed
    assert 0.249 < speed <= 0.25
    assert slow.duration == pytest.approx(full.duration / speed)
    time = np.linspace(0.0, full.duration, 333)
    there, here = full.at(time), slow.at(time / speed)
    np.testing.assert_allclose(here.position, there.position, atol=1e-9)
    for power, name in enumerate(("velocity", "acceleration", "jerk"), start=1):
        # The very instant at which a jerk jumps belongs to either side.
        close = np.isclose(getattr(here, name), speed**power * getattr(there, name), atol=1e-6)
        assert close.mean() > 0.99, name
    assert full.repeat is not None and slow.repeat is not None
    assert slow.repeat.start == pytest.approx(full.repeat.start / speed)
    for one, other in zip(slow.detail.uses, full.detail.uses, strict=True):
        assert (one.share <= other.share + 1e-9).all(), one.constraint
    again = full.slowed(0.25)
    np.testing.assert_allclose(again.position, slow.position, atol=1e-12)
    assert again.repeat is not None
    assert again.repeat.period == pytest.approx(slow.repeat.period)
    assert again.repeat.count == slow.repeat.count


@pytest.mark.slow
@pytest.mark.parametrize("family", ["ruckig", "fourier"])
def test_slow_periods_are_a_whole_number_of_cycles(family: str) -> None:
    robot = load("tx40")
    settings = {"family": family, "periods": 2, "duration": 8.0, "evaluations": 40}
    full, slow = small_plan(robot, **settings), small_plan(robot, **settings, speed=0.6)
    for motion in (slow, full.slowed(0.6)):
        assert motion.repeat is not None
        cycles = motion.repeat.period / motion.cycle_time
        assert cycles == pytest.approx(round(cycles), abs=1e-6)
        assert 0.59 < motion.speed <= 0.6
        first = np.linspace(motion.repeat.start, motion.repeat.start + motion.repeat.period, 500)
        once, again = motion.at(first), motion.at(first + motion.repeat.period)
        np.testing.assert_allclose(again.position, once.position, atol=1e-9)


def test_periods_repeat_the_motion() -> None:
    once, thrice = (small_plan(load("emps"), periods=periods) for periods in (1, 3))
    assert thrice.duration == pytest.approx(3 * once.duration)
    for k in range(3):
        part = thrice.position[k * 1500 : (k + 1) * 1500 + 1]
        np.testing.assert_allclose(part, once.position, atol=1e-9)


def test_chosen_parameters_come_out_sharper() -> None:
    robot = load("emps")
    names = base_parameters(RegressorModel.of(robot)).names
    friction = names.index("Fc1")
    everything = small_plan(robot, evaluations=600)
    chosen = small_plan(robot, evaluations=600, objective=Objective("trace", None, (friction,)))
    assert chosen.detail.percent_sigma[friction] < everything.detail.percent_sigma[friction]


@pytest.mark.parametrize(
    ("changes", "constraint", "text"),
    [
        ({"start": [5.0]}, "position", r"^carriage: start position is 5; allowed: -0\.3 to 0\.3$"),
        ({"duration": 0.0}, "duration", r"^duration is 0\.0 s; allowed: above 0$"),
        ({"duration": 1e-3}, "duration", r"allowed: a longer duration"),
        ({"cycle_time": -1.0}, "cycle time", r"^cycle time is -1\.0 s; allowed: above 0$"),
        ({"evaluations": 0}, "evaluations", r"^evaluations is 0; allowed: 1 or more$"),
        ({"periods": 0}, "periods", r"^periods is 0; allowed: 1 or more$"),
        ({"speed": 0.0}, "speed", r"^speed is 0\.0; allowed: above 0, up to 1$"),
        (
            {"conditions": Conditions(tool_speed=0.0)},
            "tool speed",
            r"^tool speed is 0\.0 m/s; allowed: above 0$",
        ),
        (
            {"conditions": Conditions(tool_speed=1e-4)},
            "tool speed",
            r"^tool speed of 0\.0001 m/s leaves no time for a motion in 6 s; allowed: ",
        ),
        (
            {"conditions": Conditions(tool=Tool("gripper"))},
            "tool",
            r"^no tool frame 'gripper' in the URDF; allowed: rail, table$",
        ),
    ],
)
def test_what_cannot_be_met_is_named(changes: dict[str, object], constraint: str, text: str) -> None:
    with pytest.raises(PlanError, match=text) as refused:
        small_plan(load("emps"), **changes)
    assert refused.value.constraint == constraint
    assert "\n" not in str(refused.value)


def test_motors_too_weak_to_hold_the_arm_are_named() -> None:
    robot = load("tx40")
    weak = tuple(j.model_copy(update={"torque": 0.1 * j.torque}) for j in robot.joint)
    with pytest.raises(PlanError, match=r"^joint_\d: torque reaches") as refused:
        small_plan(robot.model_copy(update={"joint": weak}))
    assert refused.value.constraint == "torque"


def limited(robot: Robot, joint: int, **limits: float) -> Robot:
    """The same arm with other limits of one joint, as a description made by a program may have."""
    joints = list(robot.joint)
    joints[joint] = joints[joint].model_copy(update=limits)
    return robot.model_copy(update={"joint": tuple(joints)})


@pytest.mark.parametrize(
    ("limits", "why"),
    [({"jerk": 1e-4}, "jerk"), ({"acceleration": 1e-5}, "acceleration"), ({"velocity": 1e-5}, "velocity")],
)
def test_a_limit_that_leaves_no_motion_is_named_with_its_joint(limits: dict[str, float], why: str) -> None:
    robot = limited(load("tx40"), 2, **limits)
    with pytest.raises(PlanError, match=rf"^joint_3: no motion .* fits into 6 s, its {why} limit") as refused:
        small_plan(robot)
    assert (refused.value.constraint, refused.value.joint) == ("duration", "joint_3")


@pytest.mark.parametrize("name", ["jerk", "acceleration", "velocity"])
def test_a_limit_of_zero_is_refused_with_its_joint(name: str) -> None:
    with pytest.raises(PlanError, match=rf"^joint_2: {name} limit is 0; allowed: above 0$") as refused:
        small_plan(limited(load("tx40"), 1, **{name: 0.0}))
    assert (refused.value.constraint, refused.value.joint) == (name, "joint_2")
