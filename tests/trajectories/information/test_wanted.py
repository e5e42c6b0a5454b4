"""Words for parameters: which are meant, and a payload's σ against least squares by hand."""

from __future__ import annotations

import numpy as np
import pytest

from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.regressor import RegressorModel
from robots import load
from trajectories import PlanError, objective_for, plan
from trajectories.information.wanted import payload_directions, payload_sigma


@pytest.fixture(scope="module")
def base() -> BaseParameters:
    return base_parameters(RegressorModel.of(load("tx40")))


@pytest.mark.parametrize(
    ("word", "names"),
    [
        ("friction4", {"Fv4", "Fc4"}),
        ("friction6", {"Fv6", "Fc6", "Fvm6", "Fcm6"}),
        ("offset2", {"off2"}),
        ("ZZ1R", {"ZZ1R"}),
        ("joint1", {"ZZ1R", "Fv1", "Fc1", "off1"}),
    ],
)
def test_a_word_means_these(base: BaseParameters, word: str, names: set[str]) -> None:
    objective = objective_for(base, [word])
    assert objective.chosen is not None
    assert {base.names[k] for k in objective.chosen} == names


def test_words_add_up_and_all_is_the_default(base: BaseParameters) -> None:
    both = objective_for(base, ["friction1", "Fv1", "offset1"]).chosen
    assert both is not None and {base.names[k] for k in both} == {"Fv1", "Fc1", "off1"}
    assert objective_for(base).chosen is None and objective_for(base).directions is None


def test_a_payload_is_seen_as_sharply_as_least_squares_says(base: BaseParameters) -> None:
    trajectory = plan(load("tx40"), cycle_time=0.004, duration=6.0, seed=1, evaluations=60)
    prediction = trajectory.detail.prediction
    assert prediction is not None
    directions, parameters = payload_directions(base)
    rows = np.linalg.cholesky(prediction.information.matrix / (100.0 * prediction.row_time)).T
    by_hand = np.sqrt(np.diag(np.linalg.pinv(rows @ directions) @ np.linalg.pinv(rows @ directions).T))
    found = payload_sigma(base, prediction)
    assert tuple(found) == parameters[:4]
    assert [(p.name, p.unit) for p in found] == [("M6", "kg"), *((f"M{axis}6", "kg·m") for axis in "XYZ")]
    np.testing.assert_allclose(list(found.values()), by_hand[:4], rtol=1e-6)


def test_a_plan_for_the_payload_sees_it_better_than_a_plan_for_all(base: BaseParameters) -> None:
    robot, settings = load("tx40"), {"cycle_time": 0.004, "duration": 6.0, "seed": 1, "evaluations": 250}
    everything = plan(robot, **settings).detail.prediction  # type: ignore[arg-type]
    chosen = plan(robot, objective=objective_for(base, ["payload"]), **settings).detail.prediction  # type: ignore[arg-type]
    assert everything is not None and chosen is not None
    usual, better = (np.array(list(payload_sigma(base, p).values())) for p in (everything, chosen))
    assert np.log(better / usual).mean() < -0.1


@pytest.mark.parametrize(
    ("words", "criterion", "text"),
    [
        (["ZZ9"], "determinant", r'^no base parameter is meant by "ZZ9"; allowed: ZZ1R, '),
        (["joint"], "determinant", r'^no base parameter is meant by "joint"; '),
        (["payload", "ZZ1R"], "trace", r'^"payload" stands alone'),
        (["friction"], "condition", r"^the condition number is of all parameters"),
    ],
)
def test_words_that_mean_nothing_are_refused(
    base: BaseParameters, words: list[str], criterion: str, text: str
) -> None:
    with pytest.raises(PlanError, match=text):
        objective_for(base, words, criterion)  # type: ignore[arg-type]
