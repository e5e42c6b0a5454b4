"""The smallest size of what shows at reversals alone: what is said of it, and what the loop then names."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

import robots
from drivers.simulated.scenario import Scenario
from ident import Recording
from ident.discrepancy.by_evidence.decide.names import SURE
from ident.discrepancy.by_evidence.evidence.loop_rows import LoopRows
from ident.discrepancy.by_evidence.library.candidates import candidates
from ident.discrepancy.by_evidence.power import reversals
from ident.discrepancy.by_evidence.power.planned import known_from_run, planned_sizes
from ident.discrepancy.by_evidence.power.reversals import (
    AsKnown,
    SeenInLoop,
    seen_in_loop,
    sizes_at_reversals,
)
from ident.discrepancy.by_evidence.power.smallest import Smallest, smallest_sizes
from ident.discrepancy.by_evidence.reversals import posed_in_loop
from ident.discrepancy.step import LoopStep
from ident.effects import FrictionSign
from ident.effects.simulated import Bristle, SoftConstraint
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import hidden, recorded
from tests.ident.discrepancy.by_evidence.reversal_search import in_loop, looking

FRICTION = [family_named("static_friction")]


@pytest.fixture(scope="module")
def clean() -> LoopStep:
    return in_loop(Scenario())


@pytest.fixture(scope="module")
def said(clean: LoopStep) -> dict[str, Smallest]:
    """What a look at a clean arm's loop says."""
    search = looking(clean)
    search.look()
    return {one.name: one for one in search.nameable}


def test_of_what_shows_at_reversals_alone_the_loop_says_how_small_it_could_be(
    said: dict[str, Smallest],
) -> None:
    assert set(said) == {"static_friction", "hysteresis"}
    static = said["static_friction"]
    assert static.seen and static.parameter == "Fbreak1" and static.joints == (1,)
    assert [name for name, _, _ in static.shape] == ["breakaway_speed", "presliding"]
    assert 0.0 < static.torque < static.size


@pytest.mark.parametrize(("times", "named"), [(0.25, False), (1.3, True)])
def test_the_loop_names_what_is_above_and_not_what_is_below(
    said: dict[str, Smallest], times: float, named: bool
) -> None:
    size = times * said["hysteresis"].size
    friction = {"drive": 1, "torque": size, "displacement": 0.003}
    search = looking(in_loop(hidden({"hysteresis": [friction]})))
    search.look()
    assert [name for name, _ in search.course.taken] == ["hysteresis"] * named


def test_before_the_arm_moves_nearly_the_same_is_said(clean: LoopStep, said: dict[str, Smallest]) -> None:
    robot = robots.load("emps")
    run = recorded(robot, 700, Scenario(), 0, 1, 8.0)
    reference = cast(Any, run.reference)
    motion = Recording("planned", run.time, reference, reference, np.zeros_like(reference))
    beta = clean.examination.beta
    seen = cast(Any, seen_in_loop(clean.base, beta, (run,)))
    arm = AsKnown(clean.base, clean.prior, beta, seen)
    (one,) = sizes_at_reversals(arm, (motion,), candidates(robot, FRICTION))
    assert one.size == pytest.approx(said["static_friction"].size, rel=0.2)
    # Nobody says how the channels of this arm lie in time; its loop is looked at once they are aligned.
    (planned,) = planned_sizes(robot, motion, known_from_run(robot, (run,)), FRICTION)
    assert planned.size == pytest.approx(one.size, rel=0.2)
    usual = replace(arm, seen=SeenInLoop(seen.noise))
    (other,) = sizes_at_reversals(usual, (motion,), candidates(robot, FRICTION))
    assert other.size > 1.5 * one.size, "its gears turn within a fifth of what is usual"


def test_of_a_limit_and_a_contact_there_is_a_size_before_the_arm_moves() -> None:
    """A limit does what follows from the torque, and where something stands only the motion says."""
    robot = robots.load("emps")
    run = recorded(robot, 700, Scenario(), 0, 1, 8.0)
    reference = cast(Any, run.reference)
    motion = Recording("planned", run.time, reference, reference, np.zeros_like(reference))
    families = [family_named(name) for name in ("saturation", "contact")]
    known = replace(known_from_run(robot, (run,)), in_loop=None)
    limit, contact = planned_sizes(robot, motion, known, families)
    torque = np.abs(run.control_signal * robot.gains).max()
    assert limit.falls and limit.parameter == "torque_limit"
    assert 0.5 * torque < limit.size < torque and limit.names(0.5 * limit.size)
    (where, angle, _), _ = contact.shape
    passed = float(np.ptp(reference))
    ends = min(abs(angle - float(reference.min())), abs(angle - float(reference.max())))
    assert where == "contact_angle" and 0.05 * passed < ends < 0.35 * passed
    assert contact.seen and not contact.falls and contact.unit == "N/m"


def test_a_motion_that_does_not_repeat_has_no_loop_that_is_looked_at(clean: LoopStep) -> None:
    robot = robots.load("emps")
    run = recorded(robot, 700, Scenario(), 0, 1, 8.0)
    half = run.piece(slice(len(run.time) // 2))
    beta = clean.examination.beta
    assert seen_in_loop(clean.base, beta, (half,)) is None
    seen = cast(Any, seen_in_loop(clean.base, beta, (run,)))
    arm = AsKnown(clean.base, clean.prior, beta, seen)
    assert sizes_at_reversals(arm, (half,), candidates(robot, FRICTION)) == ()


def test_the_loop_has_to_be_sure_of_it_alone_beside_another_standstill(
    clean: LoopStep, said: dict[str, Smallest], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = posed_in_loop(clean)
    rows = cast(LoopRows, problem.rows).exactly()
    heard: list[Any] = []
    search = looking(clean)
    search._heard = lambda problem, entries: heard.append(entries)
    search.look()
    entries = sorted(heard[0], key=lambda one: -one.white.count)

    def size(by_fit: float) -> float:
        sizes = smallest_sizes(rows, problem.level, (), entries, SURE, by_fit=by_fit)
        return {one.name: one for one in sizes}["static_friction"].size

    assert size(SURE) > 1.05 * size(0.5)
    assert said["static_friction"].size > 1.005 * size(SURE)
    monkeypatch.setattr(reversals, "_of_standstill", lambda loop: None)
    (one, _) = reversals.smallest_in_loop(rows, problem.level, entries)
    assert one.name == "static_friction" and one.size == pytest.approx(size(SURE))


def test_slower_is_the_same_law_with_what_it_turns_over_so_many_times_as_large() -> None:
    for law, slower in (
        (Bristle(1e-5, "slip"), Bristle(2e-5, "slip")),
        (FrictionSign("tanh", 0.1), FrictionSign("tanh", 0.2)),
        (SoftConstraint(0.1, 0.003), SoftConstraint(0.2, 0.006)),
    ):
        assert reversals._slower(law, 2.0) == slower
