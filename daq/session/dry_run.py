"""The dry run of ``armhil commission``: what would be driven, how long it takes, and what is open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from daq.catalogue import arms
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_arm, sha256_of
from daq.catalogue.values import ArmIdentity
from daq.session.bench import ArmOrder
from daq.session.cell import Cell
from daq.session.estimates import Estimate, estimate, require_room
from daq.session.exciting import kept_in, plan_exciting
from daq.session.motions import read_trajectory, refuse_undrivable
from daq.session.session_error import SessionError
from daq.session.stages import SLOW_SPEED, StageName, StageStatus, status
from daq.session.warm_up import warm_up
from daq.text.progress import Steps
from trajectories import Trajectory


@dataclass(frozen=True)
class CommissionRequest:
    """What to walk through.

    Attributes:
        arm: which arm, where.
        folder: for the trajectory and the recordings; exists and is writable.
        trajectory: file of a motion; one is planned where None.
        duration, periods, evaluations, seed: of the plan.
        first, last: stages to begin and to end with; see :func:`daq.session.stages.stages_to_do`.
        slow_speed: of the slow run; at most a tenth.
        rounds: of the warm-up.
        note: the operator's.
        catalogue: where passes are kept; without one everything is gone through each time.
        cell: what every motion has to keep clear of.
        confirm: asked before each stage that moves; False ends it there.
        looked: asked what only somebody in front of the arm knows; False ends the stage.
        celsius: of the hall, to be kept with the runs.
    """

    arm: ArmOrder
    folder: Path
    trajectory: Path | None = None
    duration: float = 12.0
    periods: int = 2
    evaluations: int = 6000
    seed: int = 0
    first: StageName | None = None
    last: StageName | None = None
    slow_speed: float = SLOW_SPEED
    rounds: int = 1
    note: str = ""
    catalogue: Catalogue | None = None
    cell: Cell = field(default_factory=Cell)
    confirm: Callable[[str], bool] = lambda question: True
    looked: Callable[[str], bool] = lambda question: True
    celsius: float | None = None


@dataclass(frozen=True)
class Planned:
    """What commissioning would do, known before anything moves.

    Attributes:
        file: of the trajectory.
        sha256: of that file.
        states: where each stage stands, as far as the arm is known.
        estimates: of the stages that move and whose motion is known yet.
    """

    file: Path
    sha256: str
    trajectory: Trajectory
    states: tuple[StageStatus, ...]
    estimates: dict[StageName, Estimate]


def plan_commission(request: CommissionRequest, steps: Steps) -> Planned:
    """The dry run: plan or read the trajectory, judge it, say what everything takes. No frame is sent.

    Raises:
        PlanError, TrajectoryFileError, TrajectoryError: there is no motion that may be driven, or the warm-up
            has no room.
        SessionError: the slow run would not be slow, or there is no room for the recordings.
    """
    robot = request.arm.robot
    if not 0.0 < request.slow_speed <= SLOW_SPEED:
        raise SessionError(f"--slow-speed {request.slow_speed:g}; allowed: above 0, up to {SLOW_SPEED:g}")
    file = request.trajectory or _planned_file(request, steps)
    trajectory = read_trajectory(file, robot)
    refuse_undrivable(robot, trajectory, file, request.cell)
    sha256 = sha256_of(file.read_text(encoding="utf-8"))
    start = np.asarray(trajectory.position[0])
    estimates = {
        "warm-up": estimate(robot, warm_up(robot, start, request.cell, request.rounds).duration),
        "slow run": estimate(robot, trajectory.duration / request.slow_speed),
        "full run": estimate(robot, trajectory.duration),
    }
    total = Estimate(
        sum(part.seconds for part in estimates.values()), sum(part.size for part in estimates.values())
    )
    require_room(request.folder, total)
    states = status(request.catalogue, _known_identity(request), sha256, request.cell.sha256)
    return Planned(file, sha256, trajectory, states, estimates)  # type: ignore[arg-type]


def _planned_file(request: CommissionRequest, steps: Steps) -> Path:
    robot = request.arm.robot
    trajectory = plan_exciting(
        robot,
        steps,
        duration=request.duration,
        seed=request.seed,
        evaluations=request.evaluations,
        periods=request.periods,
        conditions=request.cell.for_plans,
    )
    return kept_in(request.folder, trajectory, robot)


def _known_identity(request: CommissionRequest) -> ArmIdentity | None:
    """The arm, if the catalogue knows one of this name and kind; its drives have not been asked."""
    if request.catalogue is None:
        return None
    wanted = identity_of_arm(request.arm.robot, simulated=request.arm.simulated)
    known = [
        arm
        for arm in arms.every(request.catalogue, name=wanted.name)
        if arm.simulated == wanted.simulated and arm.serials
    ]
    return replace(wanted, serials=known[0].serials) if len(known) == 1 else None
