"""The course of a parameter over the runs of an arm, with the band that its nights are expected in."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

from daq.catalogue.values import TrendPoint
from daq.text.numbers import significant

_SIZES = {"wide": (1120, 260), "narrow": (340, 210), "small": (160, 40)}
"""Of the picture on a desk, on a phone, where letters must not shrink with it, and in the list."""
_LEFT, _BOTTOM, _TOP = 74, 24, 12
BAND = 3.0
"""Half width of the accepted band in run-to-run deviations."""
ENOUGH = 5
"""Clean runs, the baseline's included, that show by how much the arm differs from run to run."""


@dataclass(frozen=True)
class Trend:
    """One parameter.

    Attributes:
        name, unit: of it.
        picture: inline SVG; on its own page for a wide and for a narrow window, one of which is shown.
        low, high: of the accepted band; None where there is none.
        clean: runs that the band is made of; 0 where there is no baseline.
        points: (run, date, value, σ, whether it lies in the band) newest first, for the table.
    """

    name: str
    unit: str
    picture: Markup
    low: float | None
    high: float | None
    clean: int
    points: tuple[tuple[int, str, str, str, bool], ...]


def trend_of(
    points: Sequence[TrendPoint],
    baseline_model: int | None,
    clean: Collection[int] = (),
    *,
    small: bool = False,
) -> Trend:
    """The trend of one parameter.

    The band is the baseline ± three deviations between the clean runs since it, never narrower than within a
    run. A run on which something was found widens nothing; before there are five, there is no band.

    Args:
        points: of one parameter, oldest first, at least one.
        baseline_model: number of the model that counts; None where there is none.
        clean: numbers of the models on whose nights nothing was found, the baseline's included.
        small: the picture without axes, for a list.
    """
    values = np.array([point.value for point in points])
    accepted = [k for k, point in enumerate(points) if point.model_id == baseline_model]
    low = high = None
    usual = np.array([point.value for point in points if point.model_id in clean])
    if accepted and usual.size >= ENOUGH:
        half = BAND * max(float(np.std(usual, ddof=1)), points[accepted[0]].sigma)
        low, high = float(values[accepted[0]] - half), float(values[accepted[0]] + half)
    rows = tuple(
        (
            point.run_id,
            f"{point.at:%Y-%m-%d %H:%M}",
            significant(point.value, 5),
            significant(point.sigma, 2),
            low is None or high is None or low <= point.value <= high,
        )
        for point in reversed(points)
    )
    kinds = ("small",) if small else ("wide", "narrow")
    picture = Markup("").join(_picture(points, values, low, high, kind) for kind in kinds)
    counted = usual.size if accepted else 0
    return Trend(points[0].name, points[0].unit, picture, low, high, counted, rows)


def _picture(
    points: Sequence[TrendPoint],
    values: np.ndarray,
    low: float | None,
    high: float | None,
    kind: str,
) -> Markup:
    small = kind == "small"
    width, height = _SIZES[kind]
    left, bottom, top = (4, 4, 4) if small else (_LEFT, _BOTTOM, _TOP)
    times = np.array([point.at.timestamp() for point in points])
    t0, t1 = float(times[0]), float(times[-1])
    limits = [
        float(values.min()),
        float(values.max()),
        *(bound for bound in (low, high) if bound is not None),
    ]
    bottom_value, top_value = min(limits), max(limits)
    margin = 0.08 * (top_value - bottom_value) or abs(top_value) * 0.05 or 1.0
    bottom_value, top_value = bottom_value - margin, top_value + margin

    def x(time: float) -> float:
        share = 0.5 if t1 == t0 else (time - t0) / (t1 - t0)
        return left + 6 + share * (width - left - 14)

    def y(value: float) -> float:
        return top + (top_value - value) / (top_value - bottom_value) * (height - top - bottom)

    name = escape(points[0].name)
    ends = f"from {significant(float(values[0]))} to {significant(float(values[-1]))}"
    label = f"{name}: {len(points)} runs, {ends}"
    parts = [f'<svg class="trend {kind}" viewBox="0 0 {width} {height}" role="img" aria-label="{label}">']
    if low is not None and high is not None:
        parts.append(
            f'<rect class="band" x="{left}" width="{width - left - 4}" y="{y(high):.1f}" '
            f'height="{max(y(low) - y(high), 1):.1f}"/>'
        )
    if not small:
        parts += [
            f'<text x="{left - 6}" y="{y(value) + 4:.1f}" text-anchor="end">{significant(value)}</text>'
            for value in (bottom_value + margin, top_value - margin)
        ]
        when = "%H:%M UTC" if points[0].at.date() == points[-1].at.date() else "%Y-%m-%d"
        ends_of_time = ((left, "start", points[0]), (width - 4, "end", points[-1]))
        parts += [
            f'<text x="{place}" y="{height - 6}" text-anchor="{anchor}">{point.at.strftime(when)}</text>'
            for place, anchor, point in ends_of_time
        ]
    path = " ".join(f"{x(t):.1f},{y(v):.1f}" for t, v in zip(times, values, strict=True))
    parts.append(f'<polyline class="line" points="{path}"/>')
    for point, time, value in zip(points, times, values, strict=True):
        inside = low is None or high is None or low <= value <= high
        if small and point is not points[-1]:
            continue
        if inside:
            parts.append(f'<circle class="in" cx="{x(time):.1f}" cy="{y(value):.1f}" r="3"/>')
        else:  # another shape too, for who does not see the colour
            cx, cy = x(time), y(value)
            parts.append(f'<path class="out" d="M{cx:.1f} {cy - 5:.1f}l5 5-5 5-5-5z"/>')
    parts.append("</svg>")
    return Markup("".join(str(part) for part in parts))  # noqa: S704 (numbers, and a name that was escaped)
