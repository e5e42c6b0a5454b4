"""What a plan is asked for and what comes out."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from daq.planning.plan_for import Wanted
from ident import BaseParameters
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.effects.family import StandardParameter
from robots import Robot
from trajectories import (
    Conditions,
    Judgement,
    Objective,
    Trajectory,
)
from trajectories.information.matrix import Criterion
from trajectories.trajectory import ExcitingFamily

Verdict = Literal["fine", "weak", "unmeasurable", "refused"]


@dataclass(frozen=True)
class PlanRequest:
    """What to plan, or which file to judge.

    Attributes:
        robot: the arm.
        check: a trajectory to judge; None to plan one.
        family, criterion, parameters, duration, periods, seed, evaluations, searches, workers: of the plan.
        speed: below 1, the same path in 1/speed of the time.
        start: where the arm stands; home where None.
        cell: a cell file; None for nothing around.
        floor, tool_speed: instead of the cell file's.
        cycle_time: of the set-points, s; the arm's (or the file's) where None.
        earlier: a capture or model of the same arm.
        out: folder for results; a check writes none where it is None.
        power: whether to say how small each effect would be named.
        wanted: an effect that the motion is to show; None for none.
    """

    robot: Robot
    check: Path | None = None
    family: ExcitingFamily = "ruckig"
    criterion: Criterion = "determinant"
    parameters: tuple[str, ...] = ()
    duration: float = 12.0
    periods: int = 1
    seed: int = 0
    evaluations: int = 12_000
    searches: int = 2
    workers: int = 1
    speed: float = 1.0
    start: tuple[float, ...] | None = None
    cell: Path | None = None
    floor: float | None = None
    tool_speed: float | None = None
    cycle_time: float | None = None
    earlier: Path | None = None
    out: Path | None = None
    power: bool = False
    wanted: Wanted | None = None


@dataclass(frozen=True)
class PlanResult:
    """What came out.

    Attributes:
        robot, conditions, objective, base: what it was judged with.
        trajectory: planned or read, with its judgement in ``detail``.
        judgement: every limit, distance and speed.
        verdict: ``refused`` (must not be driven), ``weak`` (may be driven, shows too little),
            ``unmeasurable`` (may be driven, too short to predict anything) or ``fine``.
        remarks: what else is to be said, one sentence each.
        payload: predicted σ of the payload, where it was asked for.
        stopped: whether the search was stopped early.
        files: what was written, by kind.
        power: the smallest size of each effect that would be named; None where that was not asked.
        wanted, smallest: the effect that was asked for, and the smallest size of it that would be named.
    """

    robot: Robot
    conditions: Conditions
    objective: Objective
    base: BaseParameters
    trajectory: Trajectory
    judgement: Judgement
    verdict: Verdict
    remarks: tuple[str, ...]
    payload: dict[StandardParameter, float]
    stopped: bool
    files: dict[str, Path]
    power: tuple[Smallest, ...] | None = None
    wanted: Wanted | None = None
    smallest: Smallest | None = None
