"""The page of one plan: what the motion will tell, how near it comes to every limit, and where it goes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.planning.arm_picture import arm_bodies
from daq.planning.plan_pictures import JointFigure, PathView, limit_panel, path_view, time_ticks
from daq.planning.plan_result import PlanResult
from daq.planning.plan_tables import POOR, SCALE, parameter_rows, use_rows
from daq.report.parameters import joint_heading
from daq.report.pictures import icon, scaled
from daq.report.power import power_map
from daq.report.templates import templates, write_page
from daq.text.numbers import count, percent, setting, significant
from trajectories import Limits, Prediction, ToolSpeed, TrajectoryError
from trajectories.constraints.torque import TorqueCheck

_POINTS = 4000
_PATH_POINTS = 1200
_POSTURES = ("arm", "arm there")
"""Styles of the arm at the start and where its tool is fastest."""


_WORDS = {
    "fine": ("good", "good", "May be driven", "This motion keeps every limit and shows what was asked for"),
    "weak": ("switch", "switch", "May be driven", "This motion keeps every limit but shows too little"),
    "unmeasurable": (
        "unknown",
        "unknown",
        "May be driven",
        "This motion keeps every limit; what it shows cannot be told",
    ),
    "refused": ("bad", "bad", "Must not be driven", "This motion breaks a limit"),
}


def write_plan_page(path: Path, result: PlanResult) -> None:
    """Write the page: one HTML file that needs no other file and no network.

    Raises:
        ReportError: the file cannot be written.
    """
    write_page(path, render_plan(result))


def render_plan(result: PlanResult) -> str:
    """The page as text."""
    tone, sign, word, headline = _WORDS[result.verdict]
    prediction = result.trajectory.detail.prediction
    kind = "trajectory" if result.trajectory.family == "imported" else "exciting trajectory"
    return (
        templates()
        .get_template("plan.html.j2")
        .render(
            title=f"{result.robot.name}: {kind}",
            robot=result.robot,
            tone=tone,
            icon=icon(sign),  # type: ignore[arg-type]
            word=word,
            headline=headline,
            advice=_advice(result),
            facts=_facts(result),
            problems=[str(problem) for problem in result.judgement.problems],
            remarks=result.remarks,
            figures=_figures(result),
            views=_views(result),
            uses=use_rows(result),
            parameters=[] if prediction is None else parameter_rows(prediction),
            scale_ticks=[(scaled(v, SCALE, True), f"{v:g} %") for v in (0.1, 100.0)],
            payload=[(parameter.name, significant(sigma)) for parameter, sigma in result.payload.items()],
            prediction=None if prediction is None else _prediction_words(prediction),
            power=None if result.power is None else power_map(result.robot, result.power),
            made=_made(result),
        )
    )


def _advice(result: PlanResult) -> str:
    if result.verdict == "refused":
        return "Do not stream it: the limits that it breaks are listed below, each at its worst moment."
    if result.trajectory.speed < 1.0:
        return f"A slow run at {100 * result.trajectory.speed:g} % of the planned speed, on the same path."
    return "Drive it slowly the first time (--speed 0.1), with a hand on the emergency stop."


def _facts(result: PlanResult) -> list[tuple[str, str, str]]:
    trajectory, judgement = result.trajectory, result.judgement
    detail, nearest, tool = trajectory.detail, judgement.nearest, judgement.tool
    repeats = (
        ""
        if trajectory.repeat is None
        else f"{trajectory.repeat.count} periods of {trajectory.repeat.period:.3g} s"
    )
    use, joint = max(
        ((use, int(np.argmax(use.share))) for use in judgement.uses),
        key=lambda entry: entry[0].share[entry[1]],
    )
    facts = [
        ("Duration", f"{trajectory.duration:.2f} s", repeats or f"{count(len(trajectory.time))} set-points"),
        (
            "Largest use of a limit",
            percent(100 * float(use.share[joint])),
            f"{use.constraint}, {result.robot.joint[joint].name}",
        ),
    ]
    if detail.prediction is not None:
        shares = detail.prediction.percent_sigma[detail.prediction.values != 0.0]
        seen = int((shares <= POOR).sum())
        rest = len(detail.prediction.values) - len(shares)
        note = f"%σ up to {POOR:g}" + (f"; {rest} more are expected to be 0" if rest else "")
        facts += [
            ("Condition number", significant(detail.condition), f"score {significant(trajectory.score)}"),
            ("Parameters well seen", f"{seen} of {len(shares)}", note),
        ]
    if nearest is not None:
        facts.append(
            (
                "Nearest",
                f"{1e3 * nearest.distance:.0f} mm",
                f"{nearest.bodies[0]} to {nearest.bodies[1]} at {nearest.time:.2f} s",
            )
        )
    limit = "no limit set" if tool.limit is None else f"allowed: {tool.limit:g} m/s"
    facts.append(("Fastest tool", f"{tool.speed:.2f} m/s", f"{limit}, at {tool.time:.2f} s"))
    return facts


def _figures(result: PlanResult) -> list[JointFigure]:
    trajectory, robot = result.trajectory, result.robot
    limits = Limits.of(robot, result.conditions.margins)
    points = min(_POINTS, max(200, len(trajectory.time)))
    time = np.linspace(0.0, trajectory.duration, points)
    state = trajectory.at(time)
    torque = TorqueCheck.of(robot, limits).torque(state)
    pixels = max(60, 5000 // (4 * robot.n))
    repeat = trajectory.repeat
    starts = [] if repeat is None else [repeat.start + k * repeat.period for k in range(repeat.count)]
    figures = []
    for j, joint in enumerate(robot.joint):
        unit = joint.unit
        bounds = (
            (f"position, {unit}", state.position, limits.lower[j], limits.upper[j]),
            (f"velocity, {unit}/s", state.velocity, -limits.velocity[j], limits.velocity[j]),
            (f"acceleration, {unit}/s²", state.acceleration, -limits.acceleration[j], limits.acceleration[j]),
            (f"expected torque, {joint.torque_unit}", torque, -limits.torque[j], limits.torque[j]),
        )
        numbers = tuple((use.constraint, percent(100 * float(use.share[j]))) for use in result.judgement.uses)
        heading = joint_heading(j, joint.name)
        text = "; ".join(f"{name} {value}" for name, value in numbers)
        figures.append(
            JointFigure(
                heading=heading,
                description=f"{heading} over {trajectory.duration:.3g} s. Use of limits: {text}",
                numbers=numbers,
                panels=tuple(
                    limit_panel(what, time, values[:, j], float(low), float(high), pixels)
                    for what, values, low, high in bounds
                ),
                time_ticks=time_ticks(trajectory.duration),
                starts=tuple(scaled(s, (0.0, trajectory.duration)) for s in starts if s > 1e-9),
            )
        )
    return figures


def _views(result: PlanResult) -> list[PathView]:
    trajectory, conditions = result.trajectory, result.conditions
    tool = ToolSpeed(result.robot, conditions.tool)
    time = np.linspace(0.0, trajectory.duration, _PATH_POINTS)
    path = tool.path(trajectory.at(time).position)
    fastest = tool.path(trajectory.at(np.array([result.judgement.tool.time])).position)[0]
    around = conditions.surroundings
    ends = trajectory.at(np.array([0.0, result.judgement.tool.time])).position
    arms = {style: arm_bodies(result.robot, posture) for style, posture in zip(_POSTURES, ends, strict=True)}
    return [
        path_view(heading, axes, path, fastest, around.obstacles, around.floor, arms)
        for heading, axes in (
            ("From above: x right, y up", (0, 1)),
            ("From the side: x right, z up", (0, 2)),
            ("From the front: y right, z up", (1, 2)),
        )
    ]


def _prediction_words(prediction: Prediction) -> str:
    used = 100 * prediction.used
    return (
        f"{count(prediction.rows)} rows, {setting(1e3 * prediction.row_time)} ms apart; of each joint's rows "
        f"{used.min():.0f} to {used.max():.0f} % are fast enough. Errors expected: {prediction.noise}."
    )


def _made(result: PlanResult) -> list[tuple[str, str]]:
    trajectory, conditions, detail = result.trajectory, result.conditions, result.trajectory.detail
    around, margins = conditions.surroundings, conditions.margins
    try:
        frame = ToolSpeed(result.robot, conditions.tool).name
    except TrajectoryError:  # judged already, so it is there
        frame = ""
    watched = [("the arm itself" if around.itself else "")]
    watched += [f"floor at {around.floor:g} m" if around.floor is not None else ""]
    watched += [obstacle.name for obstacle in around.obstacles]
    return [
        ("Family", trajectory.family),
        ("Seed", str(trajectory.seed)),
        ("Trials", count(detail.evaluations) if detail.evaluations else "none"),
        ("Objective", _objective_words(result)),
        ("Cycle", f"{setting(1e3 * trajectory.cycle_time)} ms"),
        ("Watched", ", ".join(part for part in watched if part)),
        ("Clearance", f"{setting(1e3 * around.clearance)} mm"),
        ("Tool", f"{frame} + {conditions.tool.offset} m" if conditions.tool else frame),
        (
            "Limits",
            f"velocity × {margins.velocity:g}, torque × {margins.torque:g}, "
            f"{100 * margins.position:g} % of the travel free at each end",
        ),
    ]


def _objective_words(result: PlanResult) -> str:
    objective = result.objective
    words = {
        "determinant": "−log det of the information",
        "trace": "mean variance",
        "condition": "condition number",
    }[objective.criterion]
    if objective.directions is not None:
        return f"{words} of a payload's mass and first moments"
    if objective.chosen is not None:
        return f"{words} of {', '.join(result.base.names[k] for k in objective.chosen)}"
    cap = "" if objective.condition_cap is None else f", condition number up to {objective.condition_cap:g}"
    return words + cap
