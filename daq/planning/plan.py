"""``armhil plan``: an exciting trajectory planned, or any trajectory judged, with page and files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from daq.files.cell_file import CellFile, read_cell
from daq.files.run_folder import make_run_folder
from daq.planning.plan_for import Wanted, verdict_words
from daq.planning.plan_json import plan_json
from daq.planning.plan_page import write_plan_page
from daq.planning.plan_result import PlanRequest, PlanResult, Verdict
from daq.planning.plan_search import given_or, planned, planned_for, power
from daq.planning.plan_sources import known_from
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
from ident.discrepancy.by_evidence.power.smallest import Smallest
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
        MissingFromDescription: the arm has no controller.
        TrajectoryFileError, CellFileError, CaptureError, ModelFileError, OutputError: one line each.
    """
    robot = request.robot
    robot.require_controller("planning (its saturation limits the torque)")
    folder = None
    if request.check is None or request.out is not None:
        folder = make_run_folder(request.out, f"plan-{robot.name}")
    base = base_parameters(RegressorModel.of(robot))
    objective = objective_for(base, request.parameters, request.criterion)
    conditions = _conditions(request, base, steps)
    remarks: list[str] = []
    stopped, seen = False, None
    if request.check is not None:
        trajectory, remarks = _found(request, read_motion(request.check, robot))
    elif request.wanted is None:
        trajectory, stopped = planned(request, objective, conditions, steps)
    else:
        seen, stopped = planned_for(request, request.wanted, base, objective, conditions, steps)
        trajectory, objective = seen.trajectory, seen.objective
    if stopped:
        remarks.append("the search was stopped early: this is the best so far")
    with steps.step("Judge"):
        result = _judged(request, base, objective, conditions, trajectory, remarks, stopped)
    if seen is not None:
        result = replace(result, power=seen.power)
    elif request.power or request.wanted is not None:
        result = replace(result, power=power(request, trajectory, steps))
    if request.wanted is not None and result.power is not None:
        result = _with_answer(result, request.wanted, result.power)
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


def _with_answer(result: PlanResult, wanted: Wanted, power: tuple[Smallest, ...]) -> PlanResult:
    """Whether the motion shows the effect that was asked for."""
    smallest = wanted.among(power)
    weak = not smallest.names(wanted.size) and result.verdict == "fine"
    return replace(
        result,
        verdict="weak" if weak else result.verdict,
        remarks=(*result.remarks, verdict_words(wanted, smallest)),
        wanted=wanted,
        smallest=smallest,
    )


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
        given_or(request.cycle_time, found.cycle_time),
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
