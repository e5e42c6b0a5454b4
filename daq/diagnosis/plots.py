"""Pictures of a diagnosis: what a residual depends on, and how the simulated loop goes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.diagnosis.diagnosis_words import unit_of_quantity
from daq.report.pictures import Tick, nice_ticks, scaled, tick_text, trace_path
from daq.report.traces import pixels_per_trace
from daq.text.numbers import significant
from ident.discrepancy import Diagnosis
from ident.discrepancy.binned_residual import BinnedResidual
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class Plot:
    """Lines in plot units (1000 × 400) with labels of both axes; ``lines`` are (class, path)."""

    heading: str
    description: str
    unit: str
    lines: tuple[tuple[str, str], ...]
    ticks: tuple[Tick, ...]
    along: tuple[Tick, ...]
    along_unit: str


def binned_residual_plot(picture: BinnedResidual, joints: list[str], robot: Robot) -> Plot:
    """The mean residual of a joint against one quantity: without an effect, with it, what it adds."""
    joint = robot.joint[picture.joint]
    series = (("m", picture.before), ("p", picture.added), ("d", picture.after))
    along_unit = unit_of_quantity(picture.quantity, joint)
    return _plot(
        f"{joints[picture.joint]} against {picture.quantity}",
        joint.torque_unit,
        along_unit,
        picture.centre,
        series,
        pixels_per_trace(4),
        ticks=2,
    )


def loop_plots(diagnosis: Diagnosis, joints: list[str], robot: Robot) -> list[Plot]:
    """Per joint, the position error of the simulated loop before and after; none without a loop."""
    loop = diagnosis.loop
    if loop is None:
        return []
    pixels = pixels_per_trace(2 * len(joints))
    return [
        _plot(
            joint,
            robot.joint[j].unit,
            "s",
            loop.time,
            (("m", loop.before[:, j]), ("p", loop.after[:, j])),
            pixels,
        )
        for j, joint in enumerate(joints)
    ]


def _plot(
    heading: str,
    unit: str,
    along_unit: str,
    along: FloatArray,
    series: tuple[tuple[str, FloatArray], ...],
    pixels: int,
    ticks: int = 5,
) -> Plot:
    values = np.concatenate([trace for _, trace in series])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = 0.06 * (high - low) or abs(high) or 1.0
    low, high = low - margin, high + margin
    a0, a1 = float(along[0]), float(along[-1])
    a1 = a1 if a1 > a0 else a0 + 1.0
    up, right = nice_ticks(low, high, 3), nice_ticks(a0, a1, ticks)
    return Plot(
        heading=heading,
        description=f"{heading}, in {unit}, from {significant(a0)} to {significant(a1)} {along_unit}",
        unit=unit,
        lines=tuple(
            (style, trace_path(along, trace, (a0, a1, low, high), pixels)) for style, trace in series
        ),
        ticks=tuple(Tick(100.0 - scaled(v, (low, high)), tick_text(v, up)) for v in up),
        along=tuple(Tick(scaled(v, (a0, a1)), tick_text(v, right)) for v in right),
        along_unit=along_unit,
    )
