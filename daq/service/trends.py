"""The course of a parameter over the runs of an arm, with the band that its nights are expected in."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from markupsafe import Markup, escape

from daq.catalogue.values import TrendPoint
from daq.report.pictures import nice_ticks, tick_text
from daq.text.numbers import significant
from robots.arrays import FloatArray

_SIZES = {"wide": (1120, 260), "narrow": (340, 210), "small": (160, 40)}
"""Of the picture on a desk, on a phone, where letters must not shrink with it, and in the list."""
_LEFT, _BOTTOM, _TOP = 74, 24, 12
_DAY = 86400.0
_TIME_STEPS = (
    60.0,
    300.0,
    900.0,
    3600.0,
    4 * 3600.0,
    *(k * _DAY for k in (1, 2, 7, 14, 30, 91, 182, 365, 730)),
)
"""s between labels of the time axis."""
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
        points: (run, date, value, σ, whether it lies in the band) newest first, for the table; none of a
            small picture, which has no table.
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
    rows = () if small else _rows(points, low, high)
    kinds = ("small",) if small else ("wide", "narrow")
    picture = Markup("").join(_picture(points, values, low, high, kind) for kind in kinds)
    counted = usual.size if accepted else 0
    return Trend(points[0].name, points[0].unit, picture, low, high, counted, rows)


def _rows(
    points: Sequence[TrendPoint], low: float | None, high: float | None
) -> tuple[tuple[int, str, str, str, bool], ...]:
    return tuple(
        (
            point.run_id,
            f"{point.at:%Y-%m-%d %H:%M}",
            significant(point.value, 5),
            significant(point.sigma, 2),
            low is None or high is None or low <= point.value <= high,
        )
        for point in reversed(points)
    )


def axis_of(values: FloatArray, sigmas: FloatArray, band: tuple[float, float] | None) -> tuple[float, float]:
    """Range of the vertical axis: what is drawn, and never so narrow that noise looks like a course.

    Noise of one run reaches ± 2 σ: an axis of at least 24 σ leaves it a sixth of the height. Nor is an axis
    narrower than 5 % of the value, since that much of a parameter is what a check calls large.
    """
    low, high = float(np.min(values - sigmas)), float(np.max(values + sigmas))
    if band is not None:
        low, high = min(low, band[0]), max(high, band[1])
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    least = max(12.0 * float(np.median(sigmas)), 0.025 * abs(middle))
    half = max(1.08 * half, least) or 1.0
    return middle - half, middle + half


def time_ticks(first: datetime, last: datetime, most: int) -> list[tuple[datetime, str]]:
    """Times to be labelled and their labels, no two of which are the same: hours, days, months or years."""
    seconds = (last - first).total_seconds()
    step = next((step for step in _TIME_STEPS if seconds / step <= most), _TIME_STEPS[-1])
    words = "%Y-%m-%d" if step >= _DAY else "%m-%d %H:%M" if seconds > _DAY else "%H:%M"
    start = math.ceil(first.timestamp() / step) * step
    times = [datetime.fromtimestamp(t, UTC) for t in np.arange(start, last.timestamp() + 1.0, step).tolist()]
    return [(time, time.strftime(words)) for time in times[: most + 1]] or [(first, first.strftime(words))]


def _picture(
    points: Sequence[TrendPoint],
    values: FloatArray,
    low: float | None,
    high: float | None,
    kind: str,
) -> Markup:
    small = kind == "small"
    width, height = _SIZES[kind]
    left, bottom, top = (4, 4, 4) if small else (_LEFT, _BOTTOM, _TOP)
    times = np.array([point.at.timestamp() for point in points])
    sigmas = np.array([point.sigma for point in points])
    t0, t1 = float(times[0]), float(times[-1])
    band = None if low is None or high is None else (low, high)
    axis = axis_of(values, sigmas, band)

    def x(time: float) -> float:
        share = 0.5 if t1 == t0 else (time - t0) / (t1 - t0)
        return left + 6 + share * (width - left - 14)

    def y(value: float) -> float:
        return top + (axis[1] - value) / (axis[1] - axis[0]) * (height - top - bottom)

    name = escape(points[0].name)
    ends = f"from {significant(float(values[0]))} to {significant(float(values[-1]))}"
    label = f"{name}: {len(points)} runs, {ends}"
    parts = [f'<svg class="trend {kind}" viewBox="0 0 {width} {height}" role="img" aria-label="{label}">']
    if band is not None:
        parts.append(
            f'<rect class="band" x="{left}" width="{width - left - 4}" y="{y(band[1]):.1f}" '
            f'height="{max(y(band[0]) - y(band[1]), 1):.1f}"/>'
        )
    if not small:
        parts += _axes(kind, axis, (points[0].at, points[-1].at), x, y)
        bars = "".join(
            f"M{x(t):.1f} {y(v + s):.1f}V{y(v - s):.1f}"
            for t, v, s in zip(times, values, sigmas, strict=True)
        )
        parts.append(f'<path class="sigma" d="{bars}"/>')
    path = " ".join(f"{x(t):.1f},{y(v):.1f}" for t, v in zip(times, values, strict=True))
    parts.append(f'<polyline class="line" points="{path}"/>')
    for point, time, value in zip(points, times, values, strict=True):
        inside = band is None or band[0] <= value <= band[1]
        if small and point is not points[-1]:
            continue
        if inside:
            parts.append(f'<circle class="in" cx="{x(time):.1f}" cy="{y(value):.1f}" r="3"/>')
        else:  # another shape too, for who does not see the colour
            cx, cy = x(time), y(value)
            parts.append(f'<path class="out" d="M{cx:.1f} {cy - 5:.1f}l5 5-5 5-5-5z"/>')
    parts.append("</svg>")
    return Markup("".join(str(part) for part in parts))  # noqa: S704 (numbers, and a name that was escaped)


def _axes(
    kind: str,
    axis: tuple[float, float],
    span: tuple[datetime, datetime],
    x: Callable[[float], float],
    y: Callable[[float], float],
) -> list[str]:
    width, height = _SIZES[kind]
    ticks = [tick for tick in nice_ticks(*axis, 3) if axis[0] <= tick <= axis[1]]
    parts = [f'<path class="rule" d="M{_LEFT} {y(tick):.1f}H{width - 4}"/>' for tick in ticks]
    parts += [
        f'<text x="{_LEFT - 6}" y="{y(tick) + 4:.1f}" text-anchor="end">{tick_text(tick, ticks)}</text>'
        for tick in ticks
    ]
    for time, words in time_ticks(*span, 6 if kind == "wide" else 2):
        at = x(time.timestamp())
        anchor = "end" if at > width - 50 else "start" if at < _LEFT + 40 else "middle"
        parts.append(f'<path class="rule" d="M{at:.1f} {height - _BOTTOM}v5"/>')
        parts.append(f'<text x="{at:.1f}" y="{height - 6}" text-anchor="{anchor}">{words}</text>')
    return parts
