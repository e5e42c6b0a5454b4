"""Shapes in closed loop: found about, settled by simulation."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from ident.discrepancy import refine as module
from ident.discrepancy import shape_search
from ident.discrepancy.component import Component
from ident.discrepancy.examination import Examination
from ident.discrepancy.loop_examination import LoopExamination
from ident.discrepancy.refine import added_values, refine
from ident.effects.family import Place
from ident.effects.vocabulary import family_named

ABOUT, TRUE = (0.15, 2.0), (0.06, 1.0)
"""Stribeck speed and exponent: where the screening's gain is largest, and where the simulation's is."""


@pytest.mark.parametrize(("in_loop", "expected"), [(True, TRUE), (False, TRUE[:1] + ABOUT[1:])])
def test_the_simulation_has_the_last_word_on_a_shape(
    monkeypatch: pytest.MonkeyPatch, in_loop: bool, expected: tuple[float, float]
) -> None:
    simulated = []

    def solve(_: Any, components: Sequence[Component], *__: Any, exact: bool = True) -> tuple[Any, ...]:
        speed, exponent = components[0].shape
        best = TRUE if exact else ABOUT
        simulated.append(exact)
        wrong = 0.5 * (exponent != best[1])
        return np.ones(1), float(100.0 - np.log(speed / best[0]) ** 2 - wrong), np.ones((3, 1)), [1]

    monkeypatch.setattr(shape_search, "solve", solve)
    monkeypatch.setattr(module, "with_deviations", lambda examination, components, *rest: components[0])
    monkeypatch.setattr(module, "_beside", lambda examination, components, present: present)
    robot = robots.load("tx40")
    examination: Any = SimpleNamespace(
        base=SimpleNamespace(model=SimpleNamespace(robot=robot)),
        rounds=LoopExamination.rounds if in_loop else Examination.rounds,
        simulations=LoopExamination.simulations if in_loop else Examination.simulations,
        gain_of=lambda effects, values, gain: gain,
    )
    component = Component(family_named("stribeck_friction"), Place("drive", (2,)), (0.1, 2.0))
    present: Any = SimpleNamespace(without=lambda *given: None)
    found: Any = refine(examination, [component], present)
    assert found.shape == pytest.approx(expected, rel=0.01)
    if in_loop:
        assert sum(simulated) < 20 < len(simulated)


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
    )
    assert added_values(found)[0] == pytest.approx(expected)
