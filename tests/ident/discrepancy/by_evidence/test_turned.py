"""Rows at which dry friction turns its sign are no rows of a moving arm, however fast it is there."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from ident import IdentificationError
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import diagnosis, workflow
from ident.discrepancy.by_evidence.decide.left_over import misfit_of
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.evidence.prepared import Part, Prepared
from ident.discrepancy.by_evidence.evidence.turned import turned, where_turned
from ident.discrepancy.by_evidence.workflow import posed
from ident.effects import FrictionSign, State
from ident.effects.simulated import Bristle, SoftConstraint
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.constraint_rig import recorded

LAW = SoftConstraint(0.1, 0.01)


def moving(speed: float, rate: float = 0.0) -> State:
    values = np.full((3, 6), speed)
    return State(np.zeros((3, 6)), values, np.full((3, 6), rate), 0.008 * np.arange(3))


@pytest.mark.parametrize(
    ("law", "speed", "rate", "whole"),
    [
        (LAW, 0.101, 0.0, True),
        (LAW, 0.098, 0.0, False),
        (LAW, 0.05, 5.1, True),
        (LAW, 0.15, -6.0, False),
        (LAW, -0.101, 0.0, True),
        (FrictionSign("tanh", 0.1), 0.27, 0.0, True),
        (FrictionSign("tanh", 0.1), 0.26, 0.0, False),
        (Bristle(1e-4, "exponential"), 0.0, 0.0, True),
    ],
)
def test_a_drive_has_turned_where_its_friction_is_all_there(
    law: Any, speed: float, rate: float, whole: bool
) -> None:
    robot: Any = SimpleNamespace(transmission_matrix=np.eye(6))
    laws = (law, *[FrictionSign("sign", 0.0)] * 5)
    assert turned(robot, moving(speed, rate), laws)[:, 0].tolist() == [whole] * 3
    assert not where_turned_used(robots.load("tx40"), moving(0.0), (LAW,) * 6).any()


def where_turned_used(robot: Any, state: State, laws: Any) -> np.ndarray:
    used = np.ones(state.velocity.shape, dtype=np.bool_)
    part = Part(state, state, np.zeros(used.shape), used, None, 1, 0.001)
    return where_turned(Prepared(robot, (part,)), laws).used


def test_rows_beside_them_and_of_joints_that_the_drive_moves_go_too() -> None:
    robot = robots.load("tx40")
    margin = robot.identification.model_copy(update={"standstill_margin": 0.016})
    robot = robot.model_copy(update={"identification": margin})
    matrix, velocity = robot.transmission_matrix, np.ones((20, 6))
    together = np.flatnonzero(matrix[5])
    assert together.tolist() == [4, 5], "drive 6 of this arm moves with joints 5 and 6"
    velocity[10, 5] = -matrix[5, 4] / matrix[5, 5]
    state = State(np.zeros((20, 6)), velocity, np.zeros((20, 6)), 0.008 * np.arange(20))
    used = where_turned_used(robot, state, (Bristle(1e-4, "exponential"),) * 5 + (LAW,))
    for joint in together:
        assert np.flatnonzero(~used[:, joint]).tolist() == [8, 9, 10, 11, 12]
    assert used[:, :4].all()


CREEPS = SoftConstraint(0.04, 0.0095)


def question() -> Question:
    """A rig whose friction creeps where others stick."""
    fit, held = (recorded(CREEPS, motion) for motion in (0, 1))
    return Question(robots.load("emps"), (fit,), (held,), (family_named("current_offset"),))


def test_what_a_sign_of_the_speed_leaves_where_friction_turns_is_no_misfit() -> None:
    """On MuJoCo's arms it was: false names at the wrist, beside ten times the accepted misfit."""
    plain, known = posed(question()), posed(replace(question(), standstill=(CREEPS,)))
    left = [float(misfit_of(one, without_effects(one))[0]) for one in (plain, known)]
    assert left[1] < 0.1 * left[0]


def test_the_evidence_is_told_what_the_simulated_loop_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[Question] = []

    def ask(asked: Question, *_: Any, **__: Any) -> None:
        heard.append(asked)
        raise IdentificationError("enough")

    monkeypatch.setattr(diagnosis, "named_by_evidence", ask)
    for one in (question(), replace(question(), at_reversals=False)):
        with pytest.raises(IdentificationError, match="enough"):
            diagnosis.diagnose_with_evidence(one)
    assert heard[0].standstill is not None and len(heard[0].standstill) == 1
    assert heard[1].standstill is None


def test_recordings_that_were_not_fitted_are_read_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    class Read(Exception):
        pass

    def hold(problem: Any, prepared: Prepared) -> None:
        raise Read(float(prepared.used.mean()))

    monkeypatch.setattr(workflow.HeldOut, "of", hold)
    shares = []
    for standstill in (None, (CREEPS,)):
        with pytest.raises(Read) as read:
            workflow.diagnose_by_evidence(replace(question(), standstill=standstill), simulated=False)
        shares.append(read.value.args[0])
    assert 0.1 < shares[1] < 0.9 * shares[0]
