"""Discriminating motions, for effects of the vocabulary as the discrepancy search has them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from ident.effects import State
from ident.effects.family import PlacedEffect
from ident.effects.vocabulary import family_named
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from robots import load
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories import Discrimination, PlanError, Trajectory, discriminate, plan
from trajectories.limits import Limits

CYCLE = 0.004
ROW_RATE = 50.0


@dataclass(frozen=True)
class Bench:
    """An arm with an accepted model, made from an exciting motion."""

    robot: Robot
    base: BaseParameters
    present: Present
    exciting: Trajectory
    known: FloatArray

    def effect(self, name: str, *joints: int) -> PlacedEffect:
        """The family of that name at a place, with the middle one of each shape's grid."""
        family = family_named(name)
        place = next(p for p in family.places(self.robot) if p.joints == joints)
        shape = tuple(s.grid[len(s.grid) // 2] for s in family.shapes(self.robot, place))
        return family.effect(self.robot, place, shape, self.present)

    def told_apart(self, first: PlacedEffect, second: PlacedEffect, evaluations: int = 600) -> Discrimination:
        """The motion that tells two effects apart, beside the exciting one of a like search."""
        return discriminate(
            self.robot,
            self.base,
            [[first], [second]],
            cycle_time=CYCLE,
            duration=6.0,
            seed=1,
            before=self.exciting.motion,
            known=self.known,
            evaluations=evaluations,
        )


@cache
def bench() -> Bench:
    robot = load("tx40")
    model = RegressorModel.of(robot)
    exciting = plan(robot, cycle_time=CYCLE, duration=6.0, seed=1, evaluations=600)
    prediction = exciting.detail.prediction
    assert prediction is not None
    known = prediction.information.matrix / (100.0 * prediction.row_time)
    return Bench(robot, base_parameters(model), Present(model, model.prior()), exciting, known)


def left_unexplained(arm: Bench, motion: Trajectory, true: PlacedEffect, wrong: PlacedEffect) -> float:
    """How much of what the true effect makes the best fit of model and wrong effect leaves, in σ.

    By plain least squares over rows, the accepted model as rows of its own, so by another way than the
    planner's. What is left of each of the true effect's columns spans a body; returned is the logarithm of
    its mean edge, half of the mean log of the χ² by which a wrong explanation would be refused.
    """
    count = round(motion.duration * ROW_RATE)
    time = np.array([(k + 0.5) / ROW_RATE for k in range(count)])
    state = motion.at(time)
    here = State(state.position, state.velocity, state.acceleration, time)
    sigma = np.array([joint.torque_noise for joint in arm.robot.joint])
    settings = arm.robot.identification
    slow = np.abs(state.velocity) < settings.minimum_speed * arm.robot.velocity_limits

    def rows(columns: FloatArray) -> FloatArray:
        whitened = np.where(slow[:, :, np.newaxis], 0.0, columns / sigma[:, np.newaxis])
        return np.asarray(whitened.reshape(-1, columns.shape[2]))

    explained = np.hstack([rows(arm.base.columns(here)), rows(wrong.columns(here))])
    prior = np.zeros((len(arm.known), explained.shape[1]))
    prior[:, : len(arm.known)] = np.linalg.cholesky(arm.known).T
    x = np.vstack([explained, prior])
    x = x / np.linalg.norm(x, axis=0)
    true_columns = rows(true.columns(here))
    y = np.vstack([true_columns, np.zeros((len(prior), true_columns.shape[1]))])
    rest = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    return float(np.log(np.abs(np.diag(np.linalg.qr(rest, mode="r")))).mean())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("gravity_spring", 1), ("payload",)),
        (("drive_gain_error", 1), ("payload",)),
        (("gravity_spring", 1), ("drive_gain_error", 1)),
    ],
    ids=["spring-payload", "gain-payload", "spring-gain"],
)
def test_a_discriminating_motion_separates_better_than_an_exciting_one(
    first: tuple[str, int], second: tuple[str, int]
) -> None:
    arm = bench()
    one, other = arm.effect(*first), arm.effect(*second)
    found = arm.told_apart(one, other)
    (before,), (after,) = found.separation_before, found.separation_after
    for old, new in ((before.first_sigma, after.first_sigma), (before.second_sigma, after.second_sigma)):
        assert np.log(np.divide(old, new)).mean() > 0.02
    for true, wrong in ((one, other), (other, one)):
        usual, better = (
            left_unexplained(arm, motion, true, wrong) for motion in (arm.exciting, found.trajectory)
        )
        assert better > usual + 0.02


def test_a_lag_is_told_from_a_delay() -> None:
    arm = bench()
    lag, delay = arm.effect("current_loop_lag", 0), arm.effect("time_delay", 0)
    found = arm.told_apart(lag, delay)
    (before,), (after,) = found.separation_before, found.separation_after
    assert before.correlation > 0.97
    assert after.correlation < before.correlation
    assert after.first_sigma[0] < 0.75 * before.first_sigma[0]


def test_the_motion_keeps_the_limits_and_repeats_exactly() -> None:
    arm = bench()
    spring, payload = arm.effect("gravity_spring", 1), arm.effect("payload")
    found, again = (arm.told_apart(spring, payload, evaluations=100) for _ in range(2))
    trajectory = found.trajectory
    np.testing.assert_array_equal(trajectory.position, again.trajectory.position)
    np.testing.assert_allclose(trajectory.position[[0, -1]], [arm.robot.home] * 2, atol=1e-9)
    limits = Limits.of(arm.robot)
    dense = trajectory.at(np.arange(0.0, trajectory.duration, CYCLE / 20))
    for name in ("velocity", "acceleration", "jerk"):
        assert (np.abs(getattr(dense, name)) <= getattr(limits, name) * (1 + 1e-6)).all(), name
    assert all((use.share <= 1 + 1e-6).all() for use in trajectory.detail.uses)


def test_what_no_motion_tells_apart_is_said() -> None:
    arm = bench()
    payload, spring = arm.effect("payload"), arm.effect("gravity_spring", 1)
    with pytest.raises(PlanError, match=r"make the same torque: no motion tells them apart$") as refused:
        arm.told_apart(payload, arm.effect("payload"))
    assert refused.value.constraint == "candidates"
    with pytest.raises(PlanError, match=r"^payload is part of the model already: a refit explains all of it"):
        discriminate(arm.robot, arm.base, [[payload], [spring]], cycle_time=CYCLE, duration=6.0, seed=1)
    with pytest.raises(PlanError, match=r"^1 candidates, 1 of them with effects; allowed: two or more$"):
        discriminate(arm.robot, arm.base, [[payload]], cycle_time=CYCLE, duration=6.0, seed=1)
    with pytest.raises(PlanError, match=r"^1 names for 2 candidates$"):
        discriminate(
            arm.robot, arm.base, [[payload], [spring]], cycle_time=CYCLE, duration=6.0, seed=1, names=["a"]
        )
