"""Motions and columns are kept no longer than they are asked about."""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide import as_one
from ident.discrepancy.by_evidence.decide import search as module
from ident.discrepancy.by_evidence.decide.names import SURE
from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import Found, without_effects
from ident.discrepancy.by_evidence.library.candidates import candidates, library
from ident.discrepancy.by_evidence.power import smallest
from tests.ident.discrepancy.by_evidence.toy_effects import (
    family,
    names_of,
    problem_of,
    searching,
    torque,
    waves,
)


def kept(model: PresentWith) -> int:
    """Motions that a model keeps the torque of."""
    return len(model._torques._answers) + len(model.model._torques._answers)


def of_torque(force: np.ndarray) -> np.ndarray:
    """Torque of an effect that follows the model's torque in waves of 4 N."""
    return np.asarray(np.sin(0.5 * np.pi * force))


def test_a_moved_motion_is_not_kept() -> None:
    """A simplex asks about dozens, each of them once; that of the recordings is asked about again."""
    problem = problem_of(lambda q: torque(q, w9=1.0))
    model = present_with(problem, without_effects(problem))
    motion = replace(problem.prepared.parts[0].other, torque=np.zeros((1, 1)))
    model.torque(replace(motion, torque=None))
    assert kept(model) == 0
    model.torque(motion)
    assert kept(model) == 2


def test_what_shapes_were_fitted_beside_keeps_no_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each member keeps its model, which kept a hundred megabytes of motions with a play in it."""
    beside: list[PresentWith] = []

    def noted(problem: Problem, found: Found, but: int | None = None) -> PresentWith:
        model = present_with(problem, found, but)
        if but is not None:
            beside.append(model)
        return model

    for one in (module, as_one):
        monkeypatch.setattr(one, "present_with", noted)

    def hidden(position: np.ndarray) -> np.ndarray:
        speed = np.gradient(position)
        return 1.5 * of_torque(10.0 * speed / np.abs(speed).max())

    follows = family("follows", lambda q, shape: q, of_model=of_torque)
    search = searching(problem_of(hidden), [follows])
    searched = search.run()
    assert names_of(searched) == ["follows"]
    nothing = search.without(searched.found, 0)
    every = module.screen(search.problem, nothing, searched.entries)
    search.replaced(nothing, every)
    assert len(beside) > len(every)
    assert [kept(model) for model in beside] == [0] * len(beside)


def test_sizes_are_asked_of_a_vocabulary_without_its_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred megabytes of a whole arm's, when the simulated loop beside them needs most."""
    problem = problem_of(lambda q: torque(q, w9=1.0))
    wanted = candidates(problem.prepared.robot, [waves("nine", w9=1.0), waves("eleven", w11=1.0)])
    given = [library(problem.rows, wanted, present_with(problem, without_effects(problem)))]
    columns = [weakref.ref(part) for one in given[0] for part in one.white.joints if part is not None]
    left: list[int] = []

    def noted(*asked: object) -> None:
        left.append(sum(part() is not None for part in columns))

    monkeypatch.setattr(smallest, "_said", noted)
    smallest.smallest_sizes(problem.rows, problem.level, (), given.pop(), SURE)
    assert len(columns) == 2
    assert left == [0, 0]
