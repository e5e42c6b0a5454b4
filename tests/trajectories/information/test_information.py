"""The figures of a design: determinant, trace, condition, and what the search's shortcuts may not change."""

from __future__ import annotations

import numpy as np
import pytest

from robots.arrays import FloatArray
from trajectories.information.matrix import EXCESS_COST, NONE, Information, Objective


def information_matrix(seed: int, parameters: int = 8) -> FloatArray:
    rows = np.random.default_rng(seed).standard_normal((200, parameters)) * np.logspace(-2, 2, parameters)
    return rows.T @ rows


def test_figures_are_those_of_the_weighted_regressor() -> None:
    rows = np.random.default_rng(1).standard_normal((300, 5))
    information = Information(rows.T @ rows)
    assert information.condition == pytest.approx(np.linalg.cond(rows))
    assert information.trace == pytest.approx(np.trace(np.linalg.inv(rows.T @ rows)))
    assert information.log_det == pytest.approx(-np.log(np.linalg.det(rows.T @ rows)) / 5)
    np.testing.assert_allclose(information.sigma(50.0), np.sqrt(2) * information.sigma(100.0))


@pytest.mark.parametrize("criterion", ["determinant", "trace", "condition"])
def test_more_rows_never_make_the_score_worse_by_more_than_the_condition_allows(criterion: str) -> None:
    matrix = information_matrix(2)
    objective = Objective(criterion, condition_cap=None)  # type: ignore[arg-type]
    better, same = objective.score(4.0 * matrix), objective.score(matrix)
    expected = 0.0 if criterion == "condition" else np.log(4.0)
    assert same - better == pytest.approx(expected)


def test_a_condition_number_above_the_cap_costs() -> None:
    matrix = information_matrix(3)
    condition = Information(matrix).condition
    free = Objective(condition_cap=None).score(matrix)
    assert Objective(condition_cap=2 * condition).score(matrix) == pytest.approx(free)
    assert Objective(condition_cap=condition / 2).score(matrix) == pytest.approx(
        free + EXCESS_COST * np.log(2)
    )


def test_chosen_parameters_are_judged_by_their_own_covariance() -> None:
    matrix = information_matrix(4)
    covariance = np.linalg.inv(matrix)[np.ix_([1, 6], [1, 6])]
    determinant = Objective(condition_cap=None, chosen=(1, 6)).score(matrix)
    trace = Objective("trace", condition_cap=None, chosen=(1, 6)).score(matrix)
    assert determinant == pytest.approx(np.log(np.linalg.det(covariance)) / 2)
    assert trace == pytest.approx(np.log(np.trace(covariance) / 2))


def test_the_quick_answer_is_never_above_the_score_itself() -> None:
    objective = Objective(condition_cap=10.0)
    for seed in range(20):
        matrix = information_matrix(seed)
        assert objective.score(matrix, unless_above=-1e6) <= objective.score(matrix) + 1e-9


def test_what_leaves_a_parameter_unseen_has_no_score() -> None:
    matrix = information_matrix(5)
    matrix[:, 2] = matrix[:, 4]
    matrix[2] = matrix[4]
    assert Objective().score(matrix) == NONE
    matrix[2] = matrix[:, 2] = 0.0
    assert Objective().score(matrix) == NONE
    assert Information(matrix).condition == float("inf")
