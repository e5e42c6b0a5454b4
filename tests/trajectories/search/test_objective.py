"""The planner's figures against a regressor put together here, column by column, from pinocchio alone."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from robots import load, rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories import Trajectory, plan
from trajectories.motions.motion import MotionState

EVALUATIONS = 600


def standard_rows(robot: Robot, state: MotionState) -> FloatArray:
    """samples × joints × p: links, then Ia, Fv, Fc, offset per joint, then coupled drives."""
    model, n = rigid_body_model(robot), robot.n
    data = model.createData()
    width = robot.identification.friction_width

    def sign(speed: FloatArray) -> FloatArray:
        return np.sign(speed) if robot.identification.friction_sign == "sign" else np.tanh(speed / width)

    samples = []
    for q, v, a in zip(state.position, state.velocity, state.acceleration, strict=True):
        blocks = [pinocchio.computeJointTorqueRegressor(model, data, q, v, a).reshape(n, 10 * n)]
        blocks += [np.diag(a), np.diag(v), np.diag(sign(v)), np.eye(n)]
        for row in robot.transmission_matrix:
            if np.count_nonzero(row) > 1:
                # A joint's own share of the drive is in its Ia and Fv; what couples the joints is left.
                coupling = [row * (row @ x) - row**2 * x for x in (a, v)]
                blocks.append(np.column_stack([*coupling, row * sign(np.array(row @ v))]))
        samples.append(np.hstack(blocks))
    return np.array(samples)


def all_rows(robot: Robot) -> Robot:
    """The same arm, with rows that are the samples themselves as nearly as identification allows."""
    settings = robot.identification.model_copy(
        update={
            "minimum_speed": 0.0,
            "standstill_margin": 0.0,
            "decimation": 1,
            "trim_samples": (0, 0),
            "cutoff_hz": 110.0,
            "derivative_accuracy": 8,
        }
    )
    return robot.model_copy(update={"identification": settings})


def singular_values(robot: Robot, trajectory: Trajectory, columns: int) -> FloatArray:
    """Of the weighted base regressor at the samples, per 100 rows a second.

    Any base set spans the same torques, but its condition number depends on the columns chosen, so they are
    chosen here as the planner says it does: the first independent ones in order, found by another method.
    """
    rows = standard_rows(robot, trajectory.at(trajectory.time))
    generator = np.random.default_rng(99)
    shape = (150, robot.n)
    scattered = MotionState(
        generator.uniform(robot.lower, robot.upper, shape),
        *(generator.uniform(-5, 5, shape) for _ in range(3)),
    )
    probe = standard_rows(robot, scattered).reshape(-1, rows.shape[2])
    norm = np.linalg.norm(probe, axis=0)
    probe = probe / np.maximum(norm, 1e-12)
    kept: list[int] = []
    for column in np.flatnonzero(norm > 1e-8 * norm.max()).tolist():
        if np.linalg.svd(probe[:, [*kept, column]], compute_uv=False)[-1] > 1e-9:
            kept.append(column)
    assert len(kept) == columns
    noise = np.array([joint.torque_noise or 0.01 * joint.torque for joint in robot.joint])
    weighted = rows[:, :, kept] / (noise)[:, np.newaxis]
    values = np.linalg.svd(weighted.reshape(-1, columns), compute_uv=False)
    return values * np.sqrt(100.0 * trajectory.cycle_time)


@pytest.mark.parametrize(("name", "columns"), [("tx40", 61), ("emps", 4)])
def test_the_figures_agree_with_a_regressor_from_pinocchio_alone(name: str, columns: int) -> None:
    robot = all_rows(load(name))
    trajectory = plan(robot, cycle_time=0.004, duration=12.0, seed=2, evaluations=EVALUATIONS)
    values = singular_values(robot, trajectory, columns)
    assert len(trajectory.detail.parameters) == columns
    assert trajectory.detail.condition == pytest.approx(values[0] / values[-1], rel=2e-3)
    assert trajectory.detail.log_det == pytest.approx(-2 * np.log(values).mean(), rel=1e-3)
    assert trajectory.detail.trace == pytest.approx((values**-2).sum(), rel=5e-3)
