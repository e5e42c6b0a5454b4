"""``armhil plan --for``: until a motion would name the effect, else the one that names the smallest."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import robots
from daq.planning.plan_for import Wanted, plan_for, verdict_words, wanted_of
from daq.planning.plan_search import planned_for
from ident.discrepancy.by_evidence.power.smallest import Smallest
from tests.daq.planning.conftest import Plan
from trajectories import Objective, PlanError

PLAY = Wanted("backlash", (3,), 0.002)


def smallest(size: float, joints: tuple[int, ...] = (3,), rival: str = "nothing") -> Smallest:
    return Smallest("backlash", joints, "gap", "rad", size, 1.0, 3, "N·m", (), (rival, joints), 0.01)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("backlash@3=0.002", PLAY),
        (" payload=1.5", Wanted("payload", (), 1.5)),
        ("wrist_coupling@5,6=2e-1", Wanted("wrist_coupling", (5, 6), 0.2)),
    ],
)
def test_what_is_asked_for(text: str, wanted: Wanted) -> None:
    assert wanted_of(text) == wanted


@pytest.mark.parametrize(
    "text", ["", "backlash", "backlash@3", "backlash@x=1", "payload=-1", "payload=nan", "a=b"]
)
def test_what_is_no_effect_of_a_size(text: str) -> None:
    with pytest.raises(PlanError, match="allowed: EFFECT@JOINT=SIZE with a size above 0, such as backlash@3"):
        wanted_of(text)


def tried(sizes: list[float], stop_after: int = 99) -> tuple[list[tuple[str, int]], float]:
    """Which motions are planned, where they would name these sizes one after the other; and the best."""
    calls: list[tuple[str, int]] = []

    def planned(objective: Objective, number: int) -> Any:
        calls.append((objective.criterion, number))
        return SimpleNamespace(size=sizes[len(calls) - 1])

    best = plan_for(
        PLAY,
        (Objective("determinant"), Objective("trace")),
        planned,
        lambda trajectory: (smallest(1e-9, (2,)), smallest(cast(Any, trajectory).size)),
        lambda: len(calls) >= stop_after,
    )
    return calls, best.smallest.size


def test_it_plans_until_the_effect_would_be_named_and_keeps_the_best() -> None:
    assert tried([0.002]) == ([("determinant", 0)], 0.002)
    assert tried([0.004, 0.0015]) == ([("determinant", 0), ("trace", 0)], 0.0015)
    calls, best = tried([np.inf, 0.004, 0.003, 0.005, 0.006, np.inf])
    assert calls == [(name, k) for k in range(3) for name in ("determinant", "trace")]
    assert best == 0.003
    assert tried([0.004, 0.003], stop_after=2)[0] == [("determinant", 0), ("trace", 0)]


def test_an_effect_that_is_not_there_is_refused_with_what_is() -> None:
    with pytest.raises(PlanError, match=r"--for backlash@7; allowed: backlash@2, backlash@3"):
        Wanted("backlash", (7,), 1.0).among((smallest(1.0), smallest(1.0, (2,))))


def test_what_is_said() -> None:
    assert "backlash of joint 3 of 0.002 rad would be named rightly in 80%" in verdict_words(
        PLAY, smallest(0.001)
    )
    words = verdict_words(PLAY, smallest(0.005, rival="time_delay"))
    assert "would not be named: only from 0.00500 rad on, last told from time delay of joint 3" in words
    assert "it is not told from noise" in verdict_words(PLAY, smallest(np.inf))


def test_the_command_on_one_axis(plan: Plan) -> None:
    content = json.loads(plan("emps", "--periods", 2, "--seed", 1, "--for", "hysteresis@1=1e6", "--json").out)
    asked = content["for"]
    assert asked["named"] and asked["smallest"] <= asked["size"] and content["verdict"] == "fine"
    assert content["seed"] == 1, "the first motion shows it already"
    answer = plan("emps", "--periods", 2, "--seed", 1, "--for", "hysteresis@1=1e-9", "--json", "--out", "b")
    content = json.loads(answer.out)
    assert (answer.code, content["verdict"], content["for"]["named"]) == (1, "weak", False)
    assert content["for"]["smallest"] <= asked["smallest"], "the best of all that were tried"
    assert "no such" not in plan("emps", "--for", "hysteresis@4=1").refusal
    assert "--for hysteresis@4; allowed: hysteresis@1" in plan("emps", "--for", "hysteresis@4=1").refusal


def test_an_effect_or_a_place_that_the_arm_has_not_is_refused_before_a_motion_is_planned() -> None:
    tx40 = robots.load("tx40")
    Wanted("backlash", (3,), 1.0).require_place(tx40)
    Wanted("payload", (), 1.0).require_place(tx40)
    with pytest.raises(PlanError, match=r"--for backlsh@1; allowed: backlash, .*`armhil plan ARM --power`"):
        Wanted("backlsh", (1,), 1.0).require_place(tx40)
    with pytest.raises(PlanError, match=r"--for backlash@7; allowed: backlash@1, .*backlash@6$"):
        Wanted("backlash", (7,), 1.0).require_place(tx40)
    request = cast(Any, SimpleNamespace(robot=tx40))
    with pytest.raises(PlanError, match="--for nix"):
        planned_for(request, Wanted("nix", (1,), 1.0), *cast(Any, (None,) * 4))
