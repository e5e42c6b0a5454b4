"""Plan an exciting trajectory: the motion that makes the base parameters of an arm visible."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ident.base import BaseParameters, base_parameters
from ident.effects import State
from ident.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.approach import straight_move
from trajectories.collision import CollisionCheck
from trajectories.errors import PlanError, TrajectoryError
from trajectories.fourier_search import FourierSearch
from trajectories.information import NONE, Objective
from trajectories.limits import Limits, Margins, kinematic_use, require_posture, require_within
from trajectories.motion import Motion, MotionState
from trajectories.multi_start import Progress, best_of
from trajectories.optimise import WaypointSearch
from trajectories.problem import ExcitationProblem, information_of
from trajectories.segments import Waypoint, hold
from trajectories.surroundings import Surroundings
from trajectories.torque import TorqueCheck
from trajectories.trajectory import Detail, ExcitingFamily, Trajectory

SEARCH_TORQUE_SHARE = 0.97
"""The search samples torque more coarsely than the last check, so it keeps a little more away."""

SEARCH_CONDITION_SHARE = 0.97
"""The search's rows are not those of the recording, which see a slightly other condition number."""

DEFAULT_NOISE = 0.01
"""Torque noise per joint as a share of the torque limit, where nothing better is known."""


@dataclass(frozen=True)
class BaseRegressor:
    """The base regressor of an arm's usual model, as the search wants it."""

    base: BaseParameters

    def __call__(self, state: MotionState) -> FloatArray:
        """samples × joints × b."""
        return self.base.columns(State(state.position, state.velocity, state.acceleration))


def plan(
    robot: Robot,
    *,
    cycle_time: float,
    duration: float,
    seed: int,
    family: ExcitingFamily = "ruckig",
    start: ArrayLike | None = None,
    sigma: ArrayLike | None = None,
    margins: Margins | None = None,
    objective: Objective | None = None,
    surroundings: Surroundings | None = None,
    evaluations: int = 12_000,
    searches: int = 1,
    workers: int = 1,
    periods: int = 1,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
) -> Trajectory:
    """Plan a motion that starts at rest at ``start``, ends at rest at home and excites the arm.

    The result depends on the arguments alone, not on time or on the number of workers, unless stopped.

    Args:
        robot: the arm.
        cycle_time: of the samples, s.
        duration: of the motion (of one period), s.
        seed: fixes the search.
        family: ``ruckig`` (waypoints) or ``fourier`` (periodic, with lead-in and lead-out).
        start: posture (n,), rad (or m); home where not given.
        sigma: torque noise of each joint (n,), N·m (or N); 1 % of the torque limits where not given.
        margins: what is kept free of the limits.
        objective: what is minimised; −log det of the information with the condition number ≤ 150.
        surroundings: what the arm may not touch; only itself where not given.
        evaluations: trials of each search.
        searches: independent searches; the best result counts.
        workers: processes for them.
        periods: how often the motion is repeated; more than one needs start at home. In the Fourier family
            the period between lead-in and lead-out is repeated; ``duration`` is that of one with both.
        progress: told how far it is, and the best score.
        stop: asked now and then; the best motion so far is returned once it says so.

    Raises:
        PlanError: when no motion meets the request; names the constraint, the joint and where.
    """
    try:
        margins = margins or Margins()
        _require_positive("cycle time", cycle_time)
        _require_periods(robot, periods, start)
        base = base_parameters(RegressorModel.of(robot))
        collision = CollisionCheck(robot, surroundings or Surroundings())
        problem = _problem(robot, base, duration, start, sigma, margins, objective or Objective(), collision)
        for name, value in (("evaluations", evaluations), ("searches", searches), ("workers", workers)):
            _require_count(name, value)
        best, done = best_of(
            _searches(problem, family, seed, evaluations, searches, periods), workers, progress, stop
        )
        if best.best_score >= NONE:
            raise PlanError(
                f"{duration:g} s of motion leave some of the {len(base.independent)} base parameters unseen; "
                "allowed: a longer duration, more evaluations or wider position limits",
                constraint="information",
            )
        trajectory = _judged(robot, best.finished(), problem, base, collision, family, cycle_time, seed, done)
        return trajectory if periods == 1 or family == "fourier" else trajectory.repeated(periods)
    except PlanError:
        raise
    except TrajectoryError as error:
        raise PlanError.of(error) from error


def _problem(
    robot: Robot,
    base: BaseParameters,
    duration: float,
    start: ArrayLike | None,
    sigma: ArrayLike | None,
    margins: Margins,
    objective: Objective,
    collision: CollisionCheck,
) -> ExcitationProblem:
    home = np.array(robot.home)
    first = home if start is None else np.asarray(start, dtype=np.float64)
    require_posture(first, Limits.of(robot, Margins(position=0.0)), "start")
    limits = Limits.of(robot, margins).widened(first)
    torque = TorqueCheck.of(robot, limits.with_torque_share(SEARCH_TORQUE_SHARE))
    for name, posture in (("start", first), ("home", home)):
        require_within(torque.use(hold(posture, 1e-3)), limits.names)
        collision.require_clear(hold(posture, 1e-3), name)
    _require_duration(duration, first, home, limits)
    return ExcitationProblem(
        regressor=BaseRegressor(base),
        sigma=_noise(robot, sigma),
        prior=base.regroup(base.model.prior()),
        limits=limits,
        duration=duration,
        start=Waypoint.at_rest(first),
        goal=Waypoint.at_rest(home),
        objective=objective.stricter(SEARCH_CONDITION_SHARE),
        checks=(torque.within, collision.allows),
    )


def _require_positive(name: str, seconds: float) -> None:
    if not 0.0 < seconds < float("inf"):
        raise PlanError(f"{name} is {seconds} s; allowed: above 0", constraint=name)


def _require_count(name: str, value: int) -> None:
    if value < 1:
        raise PlanError(f"{name} is {value}; allowed: 1 or more", constraint=name)


def _require_periods(robot: Robot, periods: int, start: ArrayLike | None) -> None:
    _require_count("periods", periods)
    away = 0.0 if start is None else np.abs(np.asarray(start) - robot.home)
    if periods > 1 and np.max(away) > 1e-9:
        raise PlanError(
            f"a motion of {periods} periods starts at home; the start is elsewhere",
            constraint="periods",
            joint=robot.joint[int(np.argmax(away))].name,
        )


def _noise(robot: Robot, sigma: ArrayLike | None) -> FloatArray:
    if sigma is None:
        return DEFAULT_NOISE * robot.torque_limits
    noise = np.asarray(sigma, dtype=np.float64)
    if noise.shape != (robot.n,) or not (noise > 0.0).all() or not np.isfinite(noise).all():
        raise PlanError(
            f"sigma is {noise.tolist()}; allowed: {robot.n} positive numbers, one per joint",
            constraint="sigma",
        )
    return noise


def _require_duration(duration: float, start: FloatArray, goal: FloatArray, limits: Limits) -> None:
    _require_positive("duration", duration)
    needed = straight_move(start, goal, limits).duration
    if needed > duration:
        slowest = int(np.argmax(np.abs(goal - start) / limits.velocity))
        raise PlanError(
            f"the way from start to home alone takes {needed:.3f} s; the duration is {duration:g} s",
            constraint="duration",
            joint=limits.names[slowest],
        )


def _searches(
    problem: ExcitationProblem,
    family: ExcitingFamily,
    seed: int,
    evaluations: int,
    searches: int,
    periods: int,
) -> list[WaypointSearch] | list[FourierSearch]:
    seeds = [int(s) for s in np.random.SeedSequence(seed).generate_state(searches)]
    if family == "fourier":
        return [FourierSearch(problem, s, evaluations, periods) for s in seeds]
    return [WaypointSearch(problem, s, evaluations) for s in seeds]


def _judged(
    robot: Robot,
    motion: Motion,
    problem: ExcitationProblem,
    base: BaseParameters,
    collision: CollisionCheck,
    family: ExcitingFamily,
    cycle_time: float,
    seed: int,
    evaluations: int,
) -> Trajectory:
    """The last check, finer than the search's, and the figures that go with the trajectory."""
    limits = problem.limits
    uses = kinematic_use(motion, limits) + TorqueCheck.of(robot, limits).use(motion)
    require_within(uses, limits.names)
    information = information_of(motion, problem)
    identified_rate = 1.0 / (cycle_time * robot.identification.decimation)
    sigma = information.sigma(identified_rate)
    with np.errstate(divide="ignore"):
        percent = 100.0 * sigma / np.abs(problem.prior)
    return Trajectory.sampled(
        motion,
        cycle_time,
        family=family,
        seed=seed,
        score=problem.objective.stricter(1.0 / SEARCH_CONDITION_SHARE).score(information.matrix),
        detail=Detail(
            condition=information.condition,
            log_det=information.log_det,
            trace=information.trace,
            evaluations=evaluations,
            uses=uses,
            nearest=collision.require_clear(motion, "the motion"),
            parameters=base.names,
            percent_sigma=tuple(percent.tolist()),
        ),
    )
