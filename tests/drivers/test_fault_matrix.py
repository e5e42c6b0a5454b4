"""The short form of the fault matrix; benchmarks/fault_matrix.py runs all of it."""

from __future__ import annotations

import pytest

from benchmarks.fault_cases import KINDS, FaultKind, run_case
from robots import Robot


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_fault_at_a_random_time_ends_as_it_must(kind: FaultKind, tx40: Robot) -> None:
    case = run_case(tx40, kind, seed=2)
    assert not case.problems, (case.node, case.cycle, case.problems)
    if kind.bound is not None:
        assert case.run.result is None or len(case.run.rows) < 400, "the motion did not simply go on"


def test_the_judge_sees_what_is_wrong(tx40: Robot) -> None:
    dead = next(kind for kind in KINDS if kind.name == "dead node")
    wrong = FaultKind("as if nothing were to happen", dead.draw, ("completed",), ("a word",), bound=1)
    problems = " ".join(run_case(tx40, wrong, seed=2).problems)
    for part in ("ended with aborted", "says none of", "torque was off after"):
        assert part in problems
