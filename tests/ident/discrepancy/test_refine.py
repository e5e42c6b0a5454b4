"""Effects that were found, fitted together: shapes, sizes, deviations."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import robots
from ident.discrepancy import refine as module
from ident.discrepancy import refined, shape_search, solved
from ident.discrepancy.component import Component
from ident.discrepancy.examination import Examination
from ident.discrepancy.loop_examination import LoopExamination
from ident.discrepancy.refine import added_values, refit
from ident.discrepancy.refined import beside_factor
from ident.effects.family import Place, PlacedEffect
from ident.effects.vocabulary import family_named
from robots.arrays import FloatArray

BEST = 0.06
"""Stribeck speed at which the gain is largest."""


@pytest.mark.parametrize(("in_loop", "expected"), [(True, 0.065), (False, BEST)])
def test_shapes_are_fitted_where_columns_are_not_simulated(
    monkeypatch: pytest.MonkeyPatch, in_loop: bool, expected: float
) -> None:
    """Columns of a loop hold at the shapes that they were simulated with; an exponent is fitted nowhere."""

    def solve(_: Any, components: Sequence[Component], *__: Any) -> tuple[Any, ...]:
        speed, _exponent = components[0].shape
        return np.ones(1), float(100.0 - np.log(speed / BEST) ** 2), np.ones((3, 1)), [1]

    monkeypatch.setattr(shape_search, "solve", solve)
    monkeypatch.setattr(module, "with_deviations", lambda examination, components, *rest: components[0])
    monkeypatch.setattr(module, "_beside", lambda examination, components, present, alone: present)
    robot = robots.load("tx40")
    examination: Any = SimpleNamespace(
        base=SimpleNamespace(model=SimpleNamespace(robot=robot)),
        simulated=LoopExamination.simulated if in_loop else Examination.simulated,
    )
    component = Component(family_named("stribeck_friction"), Place("drive", (2,)), (0.065, 2.0))
    present: Any = SimpleNamespace(without=lambda *given: None)
    found: Any = refit(examination, [component], present)
    assert found.shape == pytest.approx((expected, 2.0), rel=0.01)


def test_shapes_that_rows_show_nothing_of_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither is one chosen beside which nothing is left, nor does the search warn of it."""
    robot = robots.load("tx40")
    examination: Any = SimpleNamespace(base=SimpleNamespace(model=SimpleNamespace(robot=robot)))
    component = Component(family_named("stribeck_friction"), Place("drive", (2,)), (0.065, 2.0))
    for seen in (False, True):

        def solve(_: Any, components: Sequence[Component], *__: Any, seen: bool = seen) -> Any:
            nearly = seen and components[0].shape[0] <= 0.065
            return (np.ones(1), 100.0 + components[0].shape[0], np.ones((3, 1)), [1]) if nearly else None

        monkeypatch.setattr(shape_search, "solve", solve)
        (found,) = shape_search.best_shapes(examination, [component], cast(Any, None), 0.1, 8)
        assert found.shape == pytest.approx(component.shape)


def test_columns_in_the_whole_model_are_made_of_the_plain_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a model that has delays already each delay would ask twice as often with every round."""
    made: list[tuple[Any, Any]] = []

    def beside(examination: Any, components: Any, present: Any, alone: Any) -> Any:
        made.append((present, alone))
        return f"round {len(made)}"

    monkeypatch.setattr(module, "_beside", beside)
    monkeypatch.setattr(module, "best_shapes", lambda examination, components, *rest: components)
    monkeypatch.setattr(module, "with_deviations", lambda *given: None)
    examination: Any = SimpleNamespace(simulated=False)
    plain: Any = "plain"
    refit(examination, [], plain)
    assert made == [("plain", "plain"), ("round 1", "plain")]


def test_a_fit_begins_with_the_model_that_another_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """Links that had taken up a gear which rings were a column's, and of 680 N·m that found nothing."""
    made_of: list[Any] = []

    def shaped(examination: Any, components: Any, present: Any, *rest: Any) -> Any:
        made_of.append(present)
        return components

    monkeypatch.setattr(
        module, "_beside", lambda examination, components, present, alone: f"beside {present}"
    )
    monkeypatch.setattr(module, "best_shapes", shaped)
    monkeypatch.setattr(module, "with_deviations", lambda *given: None)
    examination: Any = SimpleNamespace(simulated=False)
    plain: Any = "plain"
    given: Any = "given"
    refit(examination, [], plain, given)
    assert made_of == ["given", "beside given"]


@pytest.mark.parametrize(
    ("sigma", "expected"), [((0.05, 0.3), (1.0, 0.0)), ((0.3, 0.3), (1.0, 0.5)), ((0.01, 0.01), (1.0, 0.5))]
)
def test_what_was_named_stays_in_the_model_even_if_no_parameter_alone_is_sure(
    sigma: tuple[float, float], expected: tuple[float, float]
) -> None:
    effect = SimpleNamespace(bounds=((0.0, np.inf), (0.0, np.inf)))
    found: Any = SimpleNamespace(
        effects=(effect,),
        linear=(np.array([1.0, 0.5]),),
        linear_sigma=(np.array(sigma),),
        seen=(np.array([True, True]),),
        as_simulated=False,
    )
    assert added_values(found)[0] == pytest.approx(expected)


def _of_columns(examination: Any, matrix: FloatArray, own: FloatArray, residual: FloatArray) -> FloatArray:
    """Deviations of least squares, of unit noise."""
    seen = np.linalg.norm(matrix, axis=0) > 0.0
    sigma = np.zeros(seen.size)
    sigma[seen] = np.sqrt(np.diag(np.linalg.inv(matrix[:, seen].T @ matrix[:, seen])))
    return sigma


@pytest.mark.parametrize("whole", [True, False])
def test_factor_and_shape_that_share_out_one_size_are_not_unknown_by_each_other(
    monkeypatch: pytest.MonkeyPatch, whole: bool
) -> None:
    """Friction of a load was 0.91 ± 1 of itself, ± 0.02 where its share of the load is what it is."""
    monkeypatch.setattr(refined, "deviations", _of_columns)
    column = np.random.default_rng(1).normal(size=100)
    slope = column + 1e-3 * np.random.default_rng(2).normal(size=100)
    matrix = np.stack([column, slope], axis=1)
    effect: Any = SimpleNamespace(parameters=("factor",), shape=(0.15,), whole=whole)
    sigma = refined._of_noise(None, (effect,), (matrix, matrix, column))  # type: ignore[arg-type]
    alone = 1.0 / np.linalg.norm(matrix, axis=0)
    assert np.allclose(sigma, alone) is whole
    assert bool((sigma > 50.0 * alone).all()) is not whole


def test_an_effect_is_known_as_a_whole_though_its_parameters_share_out_one_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Beside what makes the same at another place it is not; its own shape is no matter."""
    monkeypatch.setattr(refined, "deviations", _of_columns)
    random = np.random.default_rng(1)
    column, apart = random.normal(size=100), 1e-3 * random.normal(size=(100, 2))
    same = np.stack([column, column + apart[:, 0], column + apart[:, 1]], axis=1)
    effect: Any = SimpleNamespace(shape=(0.15,))
    (alone,) = refined._of_sizes(None, (effect,), [np.array([2.0, 1.0])], (same, same, column))  # type: ignore[arg-type]
    assert alone == pytest.approx(1.0 / np.linalg.norm(3.0 * column), rel=0.01)
    first, _ = refined._of_sizes(
        None,  # type: ignore[arg-type]
        (SimpleNamespace(shape=()), effect),
        [np.array([1.0]), np.array([1.0])],
        (same, same, column),
    )
    assert first > 100.0 * alone


def test_a_parameter_that_no_row_shows_has_no_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """A level at standstill, on rows of a drive that moves, was of 10¹¹⁹ N·m."""
    column = np.random.default_rng(1).normal(size=100)
    effect = SimpleNamespace(bounds=((0.0, np.inf), (0.0, np.inf)), scale=(2.0, 2.0))
    block = np.stack([1e-119 * column, column], axis=1)
    monkeypatch.setattr(solved, "_placed", lambda *_: (effect, block))
    given: Any = SimpleNamespace(residual=3.0 * column)
    found = solved.solve(given, [given], given)
    assert found is not None and found[0] == pytest.approx([0.0, 3.0])


SHAPE = (1e-3, 1.0, 1e5, 0.3)
"""Gap, offset at the link, stiffness and damping of the flanks."""


class _Nothing:
    """A present model without torques; no column is asked for here."""

    def has(self, symbols: Collection[str], drive: int) -> bool:
        return True


def _effect(name: str, shape: tuple[float, ...]) -> PlacedEffect:
    robot = robots.load("tx40")
    return family_named(name).effect(robot, Place("drive", (2,)), shape, _Nothing())  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "wider"), [("joint_elasticity", True), ("hysteresis", False)])
def test_a_factor_away_from_one_widens_what_is_said_of_the_shape(name: str, wider: bool) -> None:
    family = family_named(name)
    sizes = (2e-4, 0.05) if wider else (0.05,)
    noise = np.full(len(sizes), 1e-6)
    said = beside_factor(_effect(family.name, sizes), noise, np.array([0.9]))
    expected = np.hypot(1e-6, 0.1 * np.array(sizes)) if wider else noise
    assert said == pytest.approx(expected)


def test_what_is_not_searched_for_keeps_no_deviation() -> None:
    said = beside_factor(_effect("backlash", SHAPE), np.array([1e-6, 0.0, 0.0, 0.0]), np.array([0.8]))
    assert said == pytest.approx([2e-4, 0.0, 0.0, 0.0], rel=1e-3)
