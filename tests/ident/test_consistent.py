"""The physically consistent fit, judged by what a body is and by its own objective."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio
import pytest
from scipy.stats import multivariate_normal

import robots
from daq.importing.load import load_recording
from drivers.simulated import draw_truth
from ident import BaseParameters, IdentificationError, RegressorModel, base_parameters, drive_parameters
from ident.estimators import LinearFit, Stacked, stack, weighted_least_squares
from ident.estimators.consistent import ConsistentFit, consistent_fit, consistent_standard
from ident.parameters.base import random_states
from ident.preparation.observation import observe as observed_rows
from robots import Robot, cad_parameters, rigid_body_model
from robots.pseudo_inertia import pseudo_inertia

ROWS = 120


@pytest.fixture(scope="module")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="module")
def base(tx40: Robot) -> BaseParameters:
    return base_parameters(RegressorModel.of(tx40))


@pytest.fixture(scope="module")
def truth(tx40: Robot, base: BaseParameters) -> np.ndarray:
    """A standard vector near the description; joint 6 has some friction and inertia besides its drive's."""
    plant = draw_truth(tx40, 4)
    drives = drive_parameters(tx40, plant.per_drive("Ia"), plant.per_drive("Fv"), plant.per_drive("Fc"))
    own = {"Fc6": 0.2, "Ia6": 1.2 * drives["Ia6"], "Fv6": 1.2 * drives["Fv6"]}
    return base.model.standard_parameters({**plant.parameters, **drives, **own})


@pytest.fixture(scope="module")
def observe(tx40: Robot, base: BaseParameters) -> Callable[[np.ndarray, float, int], Stacked]:
    """Rows of a base vector at random states, with white errors of a share of the torque."""
    columns = base.columns(random_states(tx40, 1, ROWS)).transpose(1, 0, 2)

    def make(beta: np.ndarray, share: float, seed: int) -> Stacked:
        torque = columns @ beta
        size = share * np.sqrt(np.mean(torque**2, axis=1, keepdims=True))
        noise = size * np.random.default_rng(seed).normal(size=torque.shape)
        joint = np.repeat(np.arange(6), ROWS)
        return Stacked((torque + noise).ravel(), columns.reshape(-1, columns.shape[2]), joint)

    return make


@pytest.fixture(scope="module")
def noisy(
    base: BaseParameters, truth: np.ndarray, observe: Callable[[np.ndarray, float, int], Stacked]
) -> tuple[Stacked, LinearFit, ConsistentFit]:
    stacked = observe(base.regroup(truth), 0.3, 2)
    fit = weighted_least_squares(stacked, base.names)
    return stacked, fit, consistent_fit(base, fit, stacked)


def principal_moments(link: np.ndarray) -> np.ndarray:
    """About the centre of mass, by pin: another road than the pseudo-inertia."""
    return np.linalg.eigvalsh(pinocchio.Inertia.FromDynamicParameters(link).inertia)


def mass_matrices(robot: Robot, base: BaseParameters, standard: np.ndarray) -> np.ndarray:
    """M(q) at random postures, column by column from the model itself: gravity off, one unit of q̈ each."""
    q = random_states(robot, 5, 60).position
    n = robot.n
    columns = []
    for j in range(n):
        state = type(random_states(robot, 5, 1))(q, np.zeros_like(q), np.tile(np.eye(n)[j], (60, 1)))
        still = type(state)(q, np.zeros_like(q), np.zeros_like(q))
        columns.append((base.model.columns(state) - base.model.columns(still)) @ standard)
    return np.stack(columns, axis=2)


def test_every_link_is_a_body(noisy: tuple[Stacked, LinearFit, ConsistentFit]) -> None:
    for link in noisy[2].standard[:60].reshape(6, 10):
        assert link[0] > 0
        moments = principal_moments(link)
        assert moments[0] > 0
        assert moments[2] <= moments[0] + moments[1]


def test_drives_do_not_feed_the_motion(
    base: BaseParameters, noisy: tuple[Stacked, LinearFit, ConsistentFit]
) -> None:
    values = dict(zip(base.model.names, noisy[2].standard, strict=True))
    assert all(values[f"{s}{j}"] >= 0 for s in ("Ia", "Fv", "Fc") for j in range(1, 7))
    for own, shared in (("Ia", "Iam6"), ("Fv", "Fvm6")):
        block = np.array([[values[f"{own}5"], values[shared]], [values[shared], values[f"{own}6"]]])
        assert np.linalg.eigvalsh(block)[0] > -1e-9


def test_the_mass_matrix_is_positive_where_that_of_least_squares_is_not(
    tx40: Robot, base: BaseParameters, noisy: tuple[Stacked, LinearFit, ConsistentFit]
) -> None:
    _, fit, consistent = noisy
    before = base.standard_from(fit.beta, base.model.prior())
    assert np.linalg.eigvalsh(mass_matrices(tx40, base, before))[:, 0].min() < 0
    assert np.linalg.eigvalsh(mass_matrices(tx40, base, consistent.standard))[:, 0].min() > 0
    assert any(body.impossible_before for body in consistent.bodies)


def objective(
    base: BaseParameters, fit: LinearFit, stacked: Stacked, standard: np.ndarray, pulled: np.ndarray
) -> float:
    """What the fit says that it minimises, written down anew; infinite where a body is impossible."""
    weights = 1.0 / fit.sigma[stacked.joint]
    rise = ((stacked.y - stacked.x @ base.regroup(standard)) * weights) @ (
        (stacked.y - stacked.x @ base.regroup(standard)) * weights
    )
    prior, cost = base.model.prior(), 0.0
    for link, other in zip(standard[:60].reshape(6, 10), prior[:60].reshape(6, 10), strict=True):
        one, two = pseudo_inertia(link), pseudo_inertia(other)
        if np.linalg.eigvalsh(one)[0] <= 0:
            return np.inf
        # Twice the Kullback-Leibler divergence of zero-mean normal distributions with these covariances.
        draw = multivariate_normal(np.zeros(4), one)
        cost += np.trace(np.linalg.solve(two, one)) - 4 + np.linalg.slogdet(two)[1] - draw.cov_object.log_pdet
    share = ((standard - prior)[60:] / np.where(prior[60:] == 0, 1.0, prior[60:]))[pulled]
    return float(rise + 2 * cost + share @ share)


def test_no_other_arm_is_better(
    base: BaseParameters, noisy: tuple[Stacked, LinearFit, ConsistentFit]
) -> None:
    stacked, fit, consistent = noisy
    # Ia1 to Ia3 are regrouped with the links'; all else of the drives is seen by itself.
    alone = np.abs(base.relation[np.count_nonzero(base.relation, axis=1) == 1]).max(axis=0)[60:]
    pulled = alone == 0
    best = objective(base, fit, stacked, consistent.standard, pulled)
    generator = np.random.default_rng(3)
    better = 0
    for size in (1e-3, 1e-2, 1e-1):
        for _ in range(150):
            trial = consistent.standard * (1 + size * generator.normal(size=consistent.standard.size))
            trial[:60] += size * 0.01 * generator.normal(size=60)
            better += objective(base, fit, stacked, trial, pulled) < best - 1e-5 * abs(best)
    assert better == 0


def test_a_possible_arm_is_left_as_it_is(
    base: BaseParameters, truth: np.ndarray, observe: Callable[[np.ndarray, float, int], Stacked]
) -> None:
    stacked = observe(base.regroup(truth), 1e-4, 3)
    fit = weighted_least_squares(stacked, base.names)
    found = consistent_fit(base, fit, stacked)
    assert np.abs(found.shift).max() < 1.0
    assert np.sqrt(np.mean(found.shift**2)) < 0.2
    assert found.residual_change_percent is not None
    assert 0 <= found.residual_change_percent < 0.5
    assert found.p_value > 0.9
    assert found.limits == ()


def test_the_distance_is_not_larger_than_errors_make_it(
    base: BaseParameters, truth: np.ndarray, observe: Callable[[np.ndarray, float, int], Stacked]
) -> None:
    for seed in range(8):
        stacked = observe(base.regroup(truth), 0.1, 100 + seed)
        fit = weighted_least_squares(stacked, base.names)
        found = consistent_fit(base, fit, stacked)
        assert found.p_value > 0.05
        assert found.expected_distance == pytest.approx(base.independent.size)


def test_what_no_arm_has_is_said_to_be_so(
    base: BaseParameters, truth: np.ndarray, observe: Callable[[np.ndarray, float, int], Stacked]
) -> None:
    beta = base.regroup(truth)
    beta[base.names.index("ZZ6")] = -0.05
    beta[base.names.index("Fc3")] = -2.0
    stacked = observe(beta, 0.01, 5)
    fit = weighted_least_squares(stacked, base.names)
    found = consistent_fit(base, fit, stacked)
    assert found.p_value < 1e-6
    assert set(found.limits) >= {"link_6", "Fc3"}
    assert "the data speak against any such arm; at the limit: link_" in found.sentence()


def test_rows_and_their_covariance_say_the_same(
    base: BaseParameters, noisy: tuple[Stacked, LinearFit, ConsistentFit]
) -> None:
    _, fit, with_rows = noisy
    without = consistent_fit(base, fit)
    assert without.residual_change_percent is None
    assert np.abs(without.shift - with_rows.shift).max() < 1e-3
    assert without.distance == pytest.approx(with_rows.distance, rel=1e-4)


def test_the_same_base_vector_split_over_possible_links(
    base: BaseParameters, truth: np.ndarray, noisy: tuple[Stacked, LinearFit, ConsistentFit]
) -> None:
    beta = base.regroup(truth)
    standard = consistent_standard(base, beta)
    assert standard is not None
    assert np.abs(base.regroup(standard) - beta).max() < 1e-12 * np.abs(beta).max()
    for link in standard[:60].reshape(6, 10):
        assert np.linalg.eigvalsh(pseudo_inertia(link))[0] > 0
    assert consistent_standard(base, noisy[1].beta) is None


def test_without_the_solver_it_says_how_to_get_it(
    base: BaseParameters,
    noisy: tuple[Stacked, LinearFit, ConsistentFit],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    with pytest.raises(IdentificationError, match=r"needs cvxpy; .* -m pip install 'armhil\[consistent\]'"):
        consistent_fit(base, noisy[1])


def test_a_link_without_mass_has_no_prior(
    base: BaseParameters, noisy: tuple[Stacked, LinearFit, ConsistentFit]
) -> None:
    prior = base.model.prior()
    prior[20:30] = 0.0
    with pytest.raises(IdentificationError, match="link_3: no mass in the URDF"):
        consistent_fit(base, noisy[1], prior=prior)


def test_a_point_mass_serves_as_a_prior(
    tx40: Robot, base: BaseParameters, noisy: tuple[Stacked, LinearFit, ConsistentFit]
) -> None:
    prior = base.model.prior()
    link = cad_parameters(rigid_body_model(tx40))[20:30]
    center = link[1:4] / link[0]
    around = link[0] * ((center @ center) * np.eye(3) - np.outer(center, center))
    prior[24:30] = around[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    found = consistent_fit(base, noisy[1], prior=prior)
    assert principal_moments(found.standard[20:30])[0] > 0


def test_the_recorded_tx40_loses_little(shared_data: Path, tx40: Robot) -> None:
    loaded = load_recording(shared_data / "tx40", tx40)
    robot = tx40.model_copy(update={"identification": loaded.settings})
    base = base_parameters(RegressorModel.of(robot))
    stacked = stack(observed_rows(base, loaded.recordings, loaded.settings))
    fit = weighted_least_squares(stacked, base.names)
    found = consistent_fit(base, fit, stacked)
    # Least squares makes five of the six links impossible; bodies cost 0.53 % of the residual.
    assert sum(body.impossible_before for body in found.bodies) == 5
    assert found.residual_change_percent is not None
    assert 0 < found.residual_change_percent < 0.6
    assert found.p_value > 0.05
    before, after = (float(np.linalg.norm(stacked.y - stacked.x @ b)) for b in (fit.beta, found.beta))
    assert after < 1.01 * before
