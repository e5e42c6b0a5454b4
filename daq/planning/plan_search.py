"""The search for a motion: once for its parameters, or until one shows an effect that was asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from signal import SIGINT, Handlers, default_int_handler, getsignal, signal
from threading import current_thread, main_thread
from typing import Any

from daq.planning.plan_for import SeenPlan, Wanted, objectives_for, plan_for
from daq.planning.plan_result import PlanRequest
from daq.planning.power import power_of
from daq.text.progress import Steps
from ident import BaseParameters
from ident.discrepancy.by_evidence.power.smallest import Smallest
from trajectories import Conditions, Objective, Trajectory, plan


def planned(
    request: PlanRequest, objective: Objective, conditions: Conditions, steps: Steps
) -> tuple[Trajectory, bool]:
    with steps.step("Search, Ctrl-C keeps the best") as update, _interruptible() as interrupted:
        trajectory = plan(
            request.robot,
            cycle_time=given_or(request.cycle_time, request.robot.bus.cycle_time),
            duration=request.duration,
            seed=request.seed,
            family=request.family,
            start=request.start,
            conditions=conditions,
            objective=objective,
            evaluations=request.evaluations,
            searches=request.searches,
            workers=request.workers,
            periods=request.periods,
            speed=request.speed,
            progress=lambda share, score: update(share, _score_text(score)),
            stop=interrupted,
        )
    return trajectory, interrupted()


def planned_for(
    request: PlanRequest,
    wanted: Wanted,
    base: BaseParameters,
    objective: Objective,
    conditions: Conditions,
    steps: Steps,
) -> tuple[SeenPlan, bool]:
    """The motion that shows one effect, and whether it was stopped early."""
    wanted.require_place(request.robot)
    stops: list[bool] = []

    def attempt(aim: Objective, number: int) -> Trajectory:
        other = replace(request, seed=request.seed + number)
        trajectory, stopped = planned(other, aim, conditions, steps)
        stops.append(stopped)
        return trajectory

    objectives = objectives_for(wanted, base, objective, request.criterion)
    seen = plan_for(wanted, objectives, attempt, lambda one: power(request, one, steps), lambda: stops[-1])
    return seen, stops[-1]


def power(request: PlanRequest, trajectory: Trajectory, steps: Steps) -> tuple[Smallest, ...]:
    """The smallest size of each effect that a recording of the motion would name.

    Raises:
        CaptureError, ModelFileError, IdentificationError, PlanError: see :func:`daq.planning.power.power_of`.
    """
    with steps.step("Smallest sizes that would be named"):
        return power_of(request.robot, trajectory, request.earlier)


def given_or(given: float | None, usual: float) -> float:
    """What was asked for, 0 too, so that it is refused by name."""
    return usual if given is None else given


def _score_text(score: float) -> str:
    return f"score {score:.3f}" if score < 1e3 else "nothing that may be driven yet"


@contextmanager
def _interruptible() -> Iterator[Callable[[], bool]]:
    """Ctrl-C asks for the best so far; a second one ends the command as usual."""
    hits: list[int] = []
    usual = getsignal(SIGINT) in (default_int_handler, Handlers.SIG_DFL)
    if current_thread() is not main_thread() or not usual:
        yield lambda: bool(hits)
        return

    def note(number: int, frame: Any) -> None:
        hits.append(number)
        signal(SIGINT, default_int_handler)

    before = signal(SIGINT, note)
    try:
        yield lambda: bool(hits)
    finally:
        signal(SIGINT, before)
