"""Whatever works side by side, an answer is that of one processor."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident.closed_loop import at_once
from ident.discrepancy import Question, described_prior
from ident.discrepancy.by_evidence import diagnose_with_evidence
from ident.discrepancy.by_evidence.report.as_json import answer_json
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import hidden, recorded

FAMILIES = ("payload", "static_friction", "hysteresis", "joint_elasticity", "stribeck_friction", "time_delay")


SCENARIO: dict[str, object] = {"stribeck_friction": [{"drive": 1, "rise": 3.0, "speed": 0.01}]}


def test_an_answer_is_the_same_by_any_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = robots.load("emps")
    fit, held = (recorded(robot, 700, hidden(SCENARIO), k, 2, 8.0) for k in (0, 2))
    question = Question(robot, (fit,), (held,), tuple(map(family_named, FAMILIES)), described_prior)
    found = []
    for number in (1, 3):
        monkeypatch.setattr(at_once, "processors", lambda number=number: number)
        found.append(diagnose_with_evidence(question))
    (alone, answer), (threaded, other) = found
    assert answer.nameable and answer_json(answer) == answer_json(other)
    assert [one.effect for one in alone.findings] == [one.effect for one in threaded.findings]
    assert np.array_equal(alone.beta, threaded.beta)
