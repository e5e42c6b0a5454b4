"""Plan an exciting trajectory: the motion that makes the base parameters of an arm visible."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.approach import lead_home, posture_of
from trajectories.constraints.torque import TorqueCheck
from trajectories.errors import PlanError, as_plan_errors
from trajectories.information.counted_rows import CountedRows
from trajectories.information.matrix import NONE, Objective
from trajectories.information.noise import TorqueNoise
from trajectories.judgement import Conditions, predicted
from trajectories.motions.motion import Motion, MotionSequence
from trajectories.motions.segments import Waypoint, hold
from trajectories.search.fourier_search import FourierSearch
from trajectories.search.multi_start import Progress, Search, best_of
from trajectories.search.optimise import WaypointSearch
from trajectories.search.problem import BaseRegressor, ExcitationProblem
from trajectories.trajectory import (
    Detail,
    ExcitingFamily,
    Repeat,
    Trajectory,
    require_share,
    sample_times,
    stretched,
)

SEARCH_TORQUE_SHARE = 0.97
"""The search samples torque more coarsely than the last check, so it keeps a little more away."""

SEARCH_CONDITION_SHARE = 0.97
"""The search's rows are not those of the recording, which see a slightly other condition number."""


def plan(
    robot: Robot,
    *,
    cycle_time: float,
    duration: float,
    seed: int,
    family: ExcitingFamily = "ruckig",
    start: ArrayLike | None = None,
    conditions: Conditions | None = None,
    objective: Objective | None = None,
    evaluations: int = 12_000,
    searches: int = 1,
    workers: int = 1,
    periods: int = 1,
    speed: float = 1.0,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
) -> Trajectory:
    """Plan a motion that starts at rest at ``start``, ends at rest at home and excites the arm.

    The result depends on the arguments alone, not on time or on the number of workers, unless stopped.

    Args:
        robot: the arm.
        cycle_time: of the samples, s.
        duration: of one period of the exciting motion, which begins and ends at home, s.
        seed: fixes the search.
        family: ``ruckig`` (waypoints) or ``fourier`` (periodic, with lead-in and lead-out).
        start: posture (n,), rad (or m), where the arm stands; home where not given. From anywhere else a slow
            move that keeps clear of everything leads home first.
        conditions: what is to be kept, and what is known of the arm.
        objective: what is minimised; −log det of the information with the condition number ≤ 150.
        evaluations: trials of each search.
        searches: independent searches; the best result counts.
        workers: processes for them.
        periods: how often the motion is repeated. In the Fourier family the period between lead-in and
            lead-out is repeated; ``duration`` is that of one with both.
        speed: below 1, the same path is run in 1/speed of the time, as for a first run; a little slower where
            that makes a repeated period a whole number of cycles.
        progress: told how far it is, and the best score.
        stop: asked now and then; the best motion so far is returned once it says so.

    Raises:
        PlanError: when no motion meets the request; names the constraint, the joint and where.
    """
    with as_plan_errors():
        conditions = conditions or Conditions()
        objective = objective or Objective()
        _require_counts(evaluations=evaluations, searches=searches, workers=workers, periods=periods)
        sample_times(duration, cycle_time)
        require_share(speed)
        base = base_parameters(RegressorModel.of(robot))
        posture = posture_of(robot, start)
        lead = lead_home(robot, posture, cycle_time, conditions)
        problem = exciting_problem(robot, base, duration, objective, conditions)
        running = searches_of(problem, family, seed, evaluations, searches, periods)
        best, done = best_of(running, workers, progress, stop)
        if best.best_score >= NONE:
            raise _nothing_found(problem, best.finished(), len(base.names))
        motion, repeat, speed = put_together(lead, best, periods, speed, cycle_time)
        origin = Origin(family, seed, done, repeat, speed)
        return finished(robot, base, motion, cycle_time, conditions, objective, origin, posture)


@dataclass(frozen=True)
class Origin:
    """How a motion came about: what goes into a trajectory beside the motion itself."""

    family: ExcitingFamily
    seed: int
    evaluations: int
    repeat: Repeat | None
    speed: float


def finished(
    robot: Robot,
    base: BaseParameters,
    motion: Motion,
    cycle_time: float,
    conditions: Conditions,
    objective: Objective,
    origin: Origin,
    start: FloatArray | None = None,
) -> Trajectory:
    """The last check, finer than the search's, and the figures that go with the trajectory.

    Raises:
        TrajectoryError: the motion breaks a constraint after all.
    """
    judgement = conditions.judge(robot, start=start).judge(motion)
    if judgement.problems:
        raise judgement.problems[0]
    noise = conditions.noise or TorqueNoise.white(robot)
    prediction = predicted(base, motion, cycle_time, noise, conditions.expected)
    return Trajectory.sampled(
        motion,
        cycle_time,
        family=origin.family,
        seed=origin.seed,
        score=objective.score(prediction.information.matrix),
        detail=Detail(origin.evaluations, judgement.uses, judgement.nearest, judgement.tool, prediction),
        repeat=origin.repeat,
        speed=origin.speed,
    )


def exciting_problem(
    robot: Robot, base: BaseParameters, duration: float, objective: Objective, conditions: Conditions
) -> ExcitationProblem:
    """The search for one period from home to home.

    Raises:
        TrajectoryError: home itself breaks a constraint, or the duration is no number above 0.
    """
    if not 0.0 < duration < float("inf"):
        raise PlanError(f"duration is {duration} s; allowed: above 0", constraint="duration")
    judge = conditions.judge(robot)
    torque = TorqueCheck.of(robot, judge.limits.with_torque_share(SEARCH_TORQUE_SHARE))
    torque.require(hold(np.array(robot.home), 1e-3))
    judge.collision.require_clear_posture(np.array(robot.home), "home")
    limited = judge.tool if conditions.tool_speed is not None else None
    rest = Waypoint.at_rest(np.array(robot.home))
    return ExcitationProblem(
        regressor=BaseRegressor(base),
        sigma=(conditions.noise or TorqueNoise.white(robot)).sigma,
        prior=base.regroup(base.model.prior()),
        limits=judge.limits,
        duration=duration,
        start=rest,
        goal=rest,
        objective=objective.stricter(SEARCH_CONDITION_SHARE),
        checks=(torque, *([limited] if limited is not None else []), judge.collision),
        counted=CountedRows.of(robot),
        tool=limited,
        slow_passes=True,
    )


def _require_counts(**counts: int) -> None:
    for name, value in counts.items():
        if value < 1:
            raise PlanError(f"{name} is {value}; allowed: 1 or more", constraint=name)


def searches_of(
    problem: ExcitationProblem,
    family: ExcitingFamily,
    seed: int,
    evaluations: int,
    searches: int,
    periods: int,
) -> Sequence[WaypointSearch | FourierSearch]:
    """Independent searches of a problem, each from a seed of its own."""
    seeds = [int(s) for s in np.random.SeedSequence(seed).generate_state(searches)]
    if family == "fourier":
        return [FourierSearch(problem, s, evaluations, periods) for s in seeds]
    return [WaypointSearch(problem, s, evaluations) for s in seeds]


def _nothing_found(problem: ExcitationProblem, motion: Motion, parameters: int) -> PlanError:
    """Why the best motion of a search is none."""
    broken = problem.complaint(motion)
    if broken is not None:
        return PlanError.of(broken)
    return PlanError(
        f"{problem.duration:g} s of motion leave some of the {parameters} base parameters unseen; "
        "allowed: a longer duration, more evaluations or wider position limits",
        constraint="information",
    )


def put_together(
    lead: Motion | None, search: Search, periods: int, speed: float, cycle_time: float
) -> tuple[Motion, Repeat | None, float]:
    """The move to home, what a search found, its repeats, all at a speed; where the repeats are; the speed.

    Raises:
        TrajectoryError: the search's motion cannot be led in.
    """
    before = 0.0 if lead is None else lead.duration
    motion = search.finished()
    leads = () if lead is None else (lead,)
    if isinstance(search, FourierSearch):
        inside = search.repeat(motion)
        repeat = Repeat(before + inside.start, inside.period, periods)
        parts: tuple[Motion, ...] = (*leads, motion)
    else:
        repeat = Repeat(before, motion.duration, periods)
        parts = leads + (motion,) * periods
    whole = MotionSequence(parts) if len(parts) > 1 else motion
    if periods == 1:
        return stretched(whole, speed), None, speed
    # The plan itself has whole periods; those of a slower run are whole again.
    planned = repeat.whole_cycles_at(1.0, cycle_time)
    repeat = repeat.slowed(planned)
    speed = repeat.whole_cycles_at(speed, cycle_time)
    return stretched(whole, planned * speed), repeat.slowed(speed), speed
