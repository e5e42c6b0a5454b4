"""What a person sees of a plan on the terminal."""

from __future__ import annotations

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from daq.planning.plan_result import PlanResult
from daq.report.power import print_power
from daq.text.numbers import percent, significant
from trajectories import Prediction

HEADLINES = {
    "fine": "MAY BE DRIVEN, AND SHOWS WHAT WAS ASKED FOR",
    "weak": "MAY BE DRIVEN, BUT SHOWS TOO LITTLE",
    "unmeasurable": "MAY BE DRIVEN; WHAT IT SHOWS CANNOT BE TOLD",
    "refused": "MUST NOT BE DRIVEN",
}
_COLOURS = {"fine": "green", "weak": "yellow", "unmeasurable": "yellow", "refused": "red"}


def print_plan(console: Console, result: PlanResult) -> None:
    """Predicted parameters, use of the limits, and the verdict last, where the eye is."""
    prediction = result.trajectory.detail.prediction
    if prediction is not None:
        console.print(_parameter_table(prediction))
        used = ", ".join(f"{100 * share:.0f}" for share in prediction.used)
        console.print(
            f"{prediction.rows} rows, {1e3 * prediction.row_time:g} ms apart; used per joint {used} %; "
            f"errors expected: {prediction.noise}",
            highlight=False,
        )
    for parameter, sigma in result.payload.items():
        console.print(f"payload {parameter.name}: σ {significant(sigma)}", highlight=False)
    console.print(_limit_table(result))
    if result.power is not None and result.wanted is None:
        print_power(console, result.power)
    console.print(_verdict(result), highlight=False)
    for problem in result.judgement.problems:
        console.print(f"[red]broken:[/] {problem}", highlight=False)
    for remark in result.remarks:
        console.print(f"[yellow]note:[/] {remark}", highlight=False)
    for kind in ("trajectory", "samples", "page"):
        if kind in result.files:
            console.print(f"{kind}: [bold]{result.files[kind]}[/]", soft_wrap=True, highlight=False)


def _parameter_table(prediction: Prediction) -> Table:
    table = Table(
        title="Predicted, before anything moves", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1)
    )
    table.add_column("parameter", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for heading in ("expected", "σ", "% σ"):
        table.add_column(heading, justify="right", no_wrap=True)
    columns = (
        prediction.names,
        prediction.units,
        prediction.values,
        prediction.sigma,
        prediction.percent_sigma,
    )
    for name, unit, value, sigma, share in zip(*columns, strict=True):
        shown = "not seen" if np.isinf(sigma) else significant(float(sigma))
        table.add_row(name, unit, significant(float(value)), shown, percent(float(share)))
    return table


def _limit_table(result: PlanResult) -> Table:
    table = Table(
        title="Use of the limits, % (worst moment between samples too)",
        title_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1),
    )
    table.add_column("joint", no_wrap=True)
    for use in result.judgement.uses:
        table.add_column(use.constraint, justify="right", no_wrap=True)
    for k, joint in enumerate(result.robot.joint):
        cells = []
        for use in result.judgement.uses:
            share = 100.0 * float(use.share[k])
            cells.append(f"[bold red]{share:.0f}[/]" if share > 100.01 else f"{share:.0f}")
        table.add_row(joint.name, *cells)
    return table


def _verdict(result: PlanResult) -> str:
    trajectory, judgement = result.trajectory, result.judgement
    detail, nearest, tool = trajectory.detail, judgement.nearest, judgement.tool
    distance = "nothing is watched"
    if nearest is not None:
        first, second = nearest.bodies
        distance = f"nearest {1e3 * nearest.distance:.0f} mm ({first} to {second} at {nearest.time:.2f} s)"
    limit = "" if tool.limit is None else f" of {tool.limit:g}"
    slow = "" if trajectory.speed == 1.0 else f" at {100 * trajectory.speed:g} % speed"
    return (
        f"\n[bold {_COLOURS[result.verdict]}]{HEADLINES[result.verdict]}[/]\n"
        f"{trajectory.duration:.2f} s{slow}; score {significant(trajectory.score)}, "
        f"condition number {significant(detail.condition)}; {distance}; "
        f"tool up to {tool.speed:.2f}{limit} m/s at {tool.time:.2f} s"
    )
