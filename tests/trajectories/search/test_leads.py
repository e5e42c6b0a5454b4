"""Lead-in and lead-out of Fourier motions: slower where the quickest way breaks something, else refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from robots import load
from trajectories import Conditions, Objective, PlanError
from trajectories.motions.fourier import FourierMotion
from trajectories.motions.segments import Waypoint
from trajectories.plan import exciting_problem
from trajectories.search.fourier_search import FourierSearch
from trajectories.search.leads import LeadPlanner
from trajectories.search.problem import ExcitationProblem


def problem_of(tool_speed: float | None) -> ExcitationProblem:
    robot = load("tx40")
    base = base_parameters(RegressorModel.of(robot))
    return exciting_problem(robot, base, 12.0, Objective(), Conditions(tool_speed=tool_speed))


def swing(reach: float) -> FourierMotion:
    """Joint 1 there and back once in 8 s, away from home."""
    home = np.array(load("tx40").home)
    sine = np.zeros((1, 6))
    sine[0, 0] = 0.2
    return FourierMotion(8.0, 1, np.add(home, [reach, 0, 0, 0, 0, 0]), sine, np.zeros((1, 6)))


def test_the_quickest_lead_is_taken_where_nothing_forbids_it_and_a_slower_one_where_the_tool_does() -> None:
    free, slow = (LeadPlanner(problem_of(speed), 8.0).of(swing(1.0)) for speed in (None, 0.3))
    assert free is not None and slow is not None
    assert slow.duration > 1.2 * free.duration
    tool = problem_of(0.3).tool
    assert tool is not None
    for part in (slow.into, slow.out):
        assert tool.fastest(part).speed <= 0.3
    assert max(tool.fastest(part).speed for part in (free.into, free.out)) > 0.3
    entry = swing(1.0).begun(slow.begin).at(np.zeros(1))
    end = slow.into.at(np.array([slow.into.duration]))
    for name in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(end, name), getattr(entry, name), atol=1e-9)


def test_a_lead_that_the_tool_does_not_allow_in_time_says_where() -> None:
    planner = LeadPlanner(problem_of(0.2), 2.0)
    assert planner.of(swing(1.0)) is None and planner.excess(swing(1.0)) > 0.0
    refusal = planner.refusal(swing(1.0))
    assert str(refusal).startswith("lead-in of the Fourier motion: joint_1: tool speed of link_6 reaches")
    assert (refusal.constraint, refusal.joint) == ("tool speed", "joint_1") and refusal.time is not None


def test_a_lead_without_time_is_refused_for_the_time() -> None:
    planner = LeadPlanner(problem_of(None), 0.2)
    assert planner.of(swing(1.0)) is None and planner.excess(swing(1.0)) > 1.0
    assert planner.refusal(swing(1.0)).constraint == "duration"


def test_a_problem_without_fixed_ends_has_no_leads() -> None:
    with pytest.raises(ValueError, match="without fixed ends"):
        LeadPlanner(replace(problem_of(None), start=None), 2.0)


def test_whenever_the_search_is_stopped_its_motion_can_be_driven() -> None:
    problem = problem_of(0.4)
    search = FourierSearch(problem, 3, 10_000)
    found = 0
    for _ in range(4):
        search.advance(30)
        try:
            motion = search.finished()
        except PlanError:
            continue
        found += 1
        assert motion.duration == pytest.approx(12.0)
        assert all(problem.allows(part) for part in motion.parts)  # type: ignore[attr-defined]
        ends = motion.at(np.array([0.0, motion.duration]))
        rest = Waypoint.at_rest(np.array(load("tx40").home))
        np.testing.assert_allclose(ends.position, [rest.position] * 2, atol=1e-8)
        assert np.abs(ends.velocity).max() < 1e-8
    assert found >= 1
