"""What identification is expected to print: σ as least squares gives it, %σ with the value's uncertainty."""

from __future__ import annotations

import numpy as np

from drivers.simulated import draw_truth, simulate_offline
from ident import Recording, base_parameters, identify
from ident.estimators import stack, weighted_least_squares
from ident.parameters.regressor import RegressorModel
from ident.preparation.observation import observe
from robots import load
from trajectories import ExpectedValues, TorqueNoise, plan, predicted
from trajectories.information.expected import median_size


def test_the_median_of_the_size_of_a_normal_number() -> None:
    generator = np.random.default_rng(0)
    mean, sigma = np.array([0.0, 0.3, 1.0, 5.0, 2.0]), np.array([1.0, 1.0, 1.0, 1.0, 0.0])
    drawn = np.abs(mean + sigma * generator.standard_normal((200_000, 5)))
    np.testing.assert_allclose(median_size(mean, sigma), np.median(drawn, axis=0), rtol=0.01)


def test_percent_sigma_is_the_ratio_where_it_is_small_and_levels_out_where_the_parameter_drowns() -> None:
    expected = ExpectedValues(np.array([10.0, -10.0, 1e-9, 0.0, 0.0]), np.array([0.0, 0.1, 0.1, 0.1, 0.0]))
    percent = expected.percent_sigma(np.array([0.1, 0.1, 0.1, 0.1, 0.1]))
    np.testing.assert_allclose(percent[:2], [1.0, 1.0], rtol=1e-4)
    np.testing.assert_allclose(percent[2:4], 100 / (0.6745 * np.sqrt(2)), rtol=1e-3)
    assert percent[4] == np.inf
    unseen = expected.percent_sigma(np.full(5, np.inf))
    assert np.isinf(unseen).all()


def test_predicted_and_obtained_agree_on_the_simulated_carriage() -> None:
    robot = load("emps")
    base = base_parameters(RegressorModel.of(robot))
    truth = draw_truth(robot, 5)

    def planned_and_recorded(seed: int) -> tuple[object, Recording]:
        trajectory = plan(
            robot,
            cycle_time=robot.bus.cycle_time,
            duration=12.0,
            seed=seed,
            periods=2,
            evaluations=150,
        )
        run = simulate_offline(robot, truth, trajectory.position)
        return trajectory.motion, Recording(
            "simulated", run.time, run.reference, run.position, run.control_signal
        )

    _, earlier = planned_and_recorded(1)
    rows = observe(base, (earlier,), robot.identification)
    fit = weighted_least_squares(stack(rows), base.names, robot.identification.error_deviation)
    known = ExpectedValues(fit.beta, np.sqrt(np.diag(fit.covariance)))
    motion, recording = planned_and_recorded(2)
    prediction = predicted(
        base,
        motion,  # type: ignore[arg-type]
        robot.bus.cycle_time,
        TorqueNoise.of_rows(rows, fit),
        known,
    )
    found = identify(robot, (recording,)).result.least_squares.parameters
    ratio = prediction.sigma / np.array([parameter.sigma for parameter in found])
    assert ((ratio > 1 / 1.5) & (ratio < 1.5)).all(), dict(zip(base.names, ratio, strict=True))
    obtained = np.array([parameter.percent_sigma for parameter in found])
    seen = obtained < 30.0
    assert seen.sum() >= 3
    ratio = (prediction.percent_sigma / obtained)[seen]
    assert ((ratio > 1 / 1.5) & (ratio < 1.5)).all(), ratio
