"""``armhil plan``: an exciting trajectory planned, or any trajectory judged, with page and files."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from signal import SIGINT, Handlers, default_int_handler, getsignal, signal
from threading import current_thread, main_thread
from typing import Any

import numpy as np

from daq.files.cell_file import CellFile, read_cell
from daq.files.run_folder import make_run_folder
from daq.planning.plan_json import plan_json
from daq.planning.plan_page import write_plan_page
from daq.planning.plan_result import PlanRequest, PlanResult, Verdict
from daq.planning.plan_sources import known_from
from daq.planning.power import power_of
from daq.recording.trajectory_file import (
    SUFFIX,
    FoundMotion,
    description_sha256,
    read_motion,
    write_samples,
    write_trajectory,
)
from daq.text.progress import Steps
from ident import BaseParameters, RegressorModel, base_parameters
from ident.effects.family import StandardParameter
from trajectories import (
    Conditions,
    Judgement,
    Margins,
    Objective,
    PlanError,
    Prediction,
    TorqueNoise,
    Trajectory,
    objective_for,
    plan,
    predicted,
)
from trajectories.information.matrix import CONDITION_CAP
from trajectories.information.wanted import PAYLOAD, payload_sigma
from trajectories.motions.motion import Motion
from trajectories.motions.sampled import SampledMotion
from trajectories.trajectory import Detail

_CONDITION_ROOM = 1.1
"""How far above the cap the condition number may be before the verdict warns of it."""


_HIDDEN_JERK = 0.1
"""Share of the smallest jerk limit that the rounding of a file may hide without a word."""


def run_plan(request: PlanRequest, steps: Steps) -> PlanResult:
    """Plan or judge, and write what was asked for.

    Raises:
        PlanError: no motion meets the request.
        TrajectoryFileError, CellFileError, CaptureError, ModelFileError, OutputError: one line each.
    """
    robot = request.robot
    folder = None
    if request.check is None or request.out is not None:
        folder = make_run_folder(request.out, f"plan-{robot.name}")
    base = base_parameters(RegressorModel.of(robot))
    objective = objective_for(base, request.parameters, request.criterion)
    conditions = _conditions(request, base, steps)
    stopped = False
    if request.check is None:
        trajectory, stopped = _planned(request, objective, conditions, steps)
        remarks: list[str] = ["the search was stopped early: this is the best so far"] if stopped else []
    else:
        trajectory, remarks = _found(request, read_motion(request.check, robot))
    with steps.step("Judge"):
        result = _judged(request, base, objective, conditions, trajectory, remarks, stopped)
    if request.power:
        with steps.step("Smallest sizes that would be named"):
            result = replace(result, power=power_of(robot, trajectory, request.earlier))
    return result if folder is None else _written(result, folder)


def _conditions(request: PlanRequest, base: BaseParameters, steps: Steps) -> Conditions:
    cell = CellFile(format=1) if request.cell is None else read_cell(request.cell)
    surroundings = cell.surroundings
    if request.floor is not None:
        surroundings = replace(surroundings, floor=request.floor)
    with steps.step("Read what is known of the arm"):
        known = known_from(request.earlier, request.robot, base)
    # A plan keeps a distance from the limits; what somebody else planned is held to the limits themselves.
    margins = Margins() if request.check is None else Margins(position=0.0, velocity=1.0, torque=1.0)
    return Conditions(
        margins=margins,
        surroundings=surroundings,
        tool=cell.watched_tool,
        tool_speed=cell.tool.speed if request.tool_speed is None else request.tool_speed,
        noise=known.noise or TorqueNoise.white(request.robot),
        expected=known.expected,
    )


def _planned(
    request: PlanRequest, objective: Objective, conditions: Conditions, steps: Steps
) -> tuple[Trajectory, bool]:
    with steps.step("Search, Ctrl-C keeps the best") as update, _interruptible() as interrupted:
        trajectory = plan(
            request.robot,
            cycle_time=_or(request.cycle_time, request.robot.bus.cycle_time),
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


def _or(given: float | None, usual: float) -> float:
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


def _found(request: PlanRequest, found: FoundMotion) -> tuple[Trajectory, list[str]]:
    """A trajectory from a file, at the speed that is asked for, and what is to be said of it."""
    remarks = []
    if not found.is_exact:
        remarks.append("only samples are known: between them it is judged as the cubic spline through them")
    if found.robot_sha256 and found.robot_sha256 != description_sha256(request.robot):
        remarks.append("it was planned for another version of this arm's description")
    motion, least_jerk = found.motion, float(np.min(request.robot.jerk_limits))
    if isinstance(motion, SampledMotion) and motion.jerk_rounding > _HIDDEN_JERK * least_jerk:
        remarks.append(
            f"positions rounded to {motion.resolution:g} hide jerks up to {motion.jerk_rounding:.3g}"
        )
    trajectory = Trajectory.sampled(
        found.motion,
        _or(request.cycle_time, found.cycle_time),
        family=found.family,  # type: ignore[arg-type]
        seed=found.seed,
        score=found.score,
        repeat=found.repeat,
        speed=found.speed,
    )
    return (trajectory if request.speed == 1.0 else trajectory.slowed(request.speed)), remarks


def _judged(
    request: PlanRequest,
    base: BaseParameters,
    objective: Objective,
    conditions: Conditions,
    trajectory: Trajectory,
    remarks: list[str],
    stopped: bool,
) -> PlanResult:
    start = np.asarray(trajectory.position[0]) if request.check is None else None
    judgement = conditions.judge(request.robot, start=start).judge(trajectory.motion)
    prediction = _prediction(base, trajectory.motion, trajectory.cycle_time, conditions, remarks)
    if prediction is not None:
        score = objective.score(prediction.information.matrix)
        trajectory = replace(trajectory, score=score if score < 1e9 else float("nan"))
    detail = Detail(
        trajectory.detail.evaluations, judgement.uses, judgement.nearest, judgement.tool, prediction
    )
    payload: dict[StandardParameter, float] = {}
    if PAYLOAD in request.parameters and prediction is not None:
        payload = payload_sigma(base, prediction)
    return PlanResult(
        robot=request.robot,
        conditions=conditions,
        objective=objective,
        base=base,
        trajectory=replace(trajectory, detail=detail),
        judgement=judgement,
        verdict=_verdict(judgement, prediction, objective),
        remarks=(*remarks, *_weaknesses(prediction, objective)),
        payload=payload,
        stopped=stopped,
        files={},
    )


def _prediction(
    base: BaseParameters, motion: Motion, cycle_time: float, conditions: Conditions, remarks: list[str]
) -> Prediction | None:
    """What identification will make of it; None, with a remark, where it is too short for any."""
    noise = conditions.noise or TorqueNoise.white(base.model.robot)
    try:
        return predicted(base, motion, cycle_time, noise, conditions.expected)
    except PlanError as error:
        remarks.append(f"nothing can be predicted: {error}")
        return None


def _weaknesses(prediction: Prediction | None, objective: Objective) -> list[str]:
    if prediction is None:
        return []
    chosen = objective.directions is not None or objective.chosen is not None
    weaknesses = []
    if prediction.unseen and not chosen:
        weaknesses.append(f"does not show {', '.join(prediction.unseen)}")
    cap = objective.condition_cap
    condition = prediction.information.condition
    if not chosen and cap is not None and condition > _CONDITION_ROOM * cap and not prediction.unseen:
        weaknesses.append(f"condition number {condition:.0f}; asked for: at most {CONDITION_CAP:.0f}")
    if chosen and objective.score(prediction.information.matrix) >= 1e9:
        weaknesses.append("does not show the parameters that were asked for")
    return weaknesses


def _verdict(judgement: Judgement, prediction: Prediction | None, objective: Objective) -> Verdict:
    if judgement.problems:
        return "refused"
    if prediction is None:
        return "unmeasurable"
    return "weak" if _weaknesses(prediction, objective) else "fine"


def _written(result: PlanResult, folder: Path) -> PlanResult:
    """The files: exact trajectory, samples, page, and what ``--json`` prints."""
    robot = result.robot
    files = {
        "trajectory": folder / f"{robot.name}{SUFFIX}",
        "samples": folder / f"{robot.name}.trajectory.csv",
        "page": folder / "plan.html",
        "result": folder / "plan.json",
    }
    result = replace(result, files=files)
    write_trajectory(files["trajectory"], result.trajectory, robot)
    write_samples(files["samples"], result.trajectory, robot)
    write_plan_page(files["page"], result)
    text = json.dumps(plan_json(result), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    files["result"].write_text(text, encoding="utf-8")
    return result
