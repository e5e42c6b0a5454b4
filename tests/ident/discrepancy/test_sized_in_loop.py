"""What the simulated loop shows is as large as the loop that has it says, not as a little of it would be."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from ident.discrepancy import sized_in_loop as module
from ident.discrepancy.component import Component
from ident.discrepancy.course import Course
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.loop_examination import LoopExamination
from ident.discrepancy.refine import added_values, refit
from ident.discrepancy.refined import Refined
from ident.discrepancy.sized_in_loop import sized_in_loop
from ident.discrepancy.step import LoopStep
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import hidden
from tests.ident.discrepancy.by_evidence.reversal_search import in_loop

WAY = 2e-4
"""m, over which the hidden friction builds up."""


@pytest.fixture(scope="module")
def sticking() -> LoopStep:
    """An axis whose friction builds up over ten times the way that the simulation knows of, and is higher."""
    late = {"drive": 1, "rise": 8.0, "speed": 0.001, "displacement": WAY}
    return in_loop(hidden({"static_friction": [late]}))


def by_columns(step: LoopStep, name: str = "static_friction") -> Refined:
    """At twice that way, which columns do not change."""
    robot, family, place = step.base.model.robot, family_named(name), Place("drive", (0,))
    shapes = {"breakaway_speed": 3e-4, "presliding": 2.0 * WAY}
    values = (shapes.get(one.name, one.grid[0]) for one in family.shapes(robot, place))
    return refit(step.examination, [Component(family, place, tuple(values))], step.present)


def test_a_friction_that_builds_up_over_a_way_has_that_way(sticking: LoopStep) -> None:
    before = by_columns(sticking)
    found = sized_in_loop(sticking.examination, before)
    names = found.effects[0].shape_names
    way = found.components[0].shape[names.index("presliding")]
    assert way == pytest.approx(WAY, rel=0.2)
    assert before.components[0].shape[names.index("presliding")] == 2.0 * WAY
    assert found.linear[0][1] > 5.0, "of 20 N of dry friction most is late"


def test_it_enters_the_model_as_large_as_it_was_simulated(sticking: LoopStep) -> None:
    """By columns what is not sure of its size stays out, since it may be far off where it is not small."""
    found = sized_in_loop(sticking.examination, by_columns(sticking))
    unsure = replace(found, linear_sigma=(np.array([1e-9, 1e9]),))
    assert added_values(unsure)[0] == pytest.approx(found.linear[0])
    assert added_values(replace(unsure, as_simulated=False))[0][1] == 0.0


def test_a_course_goes_on_with_the_shape_that_was_simulated(sticking: LoopStep) -> None:
    course = Course.begun(sticking.examination.prepared, sticking)
    course.add_in_loop(sticking, by_columns(sticking).components[0], cast(Any, None))
    (found,) = course.findings
    way = found.component.shape[found.placed.shape_names.index("presliding")]
    assert way == pytest.approx(WAY, rel=0.2) and found.placed.shape == found.component.shape


def test_what_no_simulation_brings_nearer_stays(sticking: LoopStep, monkeypatch: pytest.MonkeyPatch) -> None:
    before = by_columns(sticking)
    monkeypatch.setattr(LoopEvidence, "change", lambda *asked: None)
    assert sized_in_loop(sticking.examination, before) is before
    monkeypatch.undo()
    best = sized_in_loop(sticking.examination, before)
    monkeypatch.setattr(module, "_JACOBIANS", 1)
    assert sized_in_loop(sticking.examination, best) is best


def test_what_its_shapes_alone_make_has_columns_of_all_of_it(sticking: LoopStep) -> None:
    play = by_columns(sticking, "backlash")
    nobody = cast(LoopExamination, None)
    assert sized_in_loop(nobody, play) is play
