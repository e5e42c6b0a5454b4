"""The course of a parameter over the runs of an arm, with the band that its nights are expected in."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from daq.catalogue.values import Course
from daq.report.pictures import nice_ticks, tick_text
from daq.text.numbers import significant
from robots.arrays import BoolArray, FloatArray

_SIZES = {"wide": (1120, 260), "narrow": (340, 210), "small": (160, 40)}
"""Of the picture on a desk, on a phone, where letters must not shrink with it, and in the list."""
_LEFT, _BOTTOM, _TOP = 82, 24, 12
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
    course: Course,
    baseline_model: int | None,
    clean: Collection[int] = (),
    *,
    small: bool = False,
) -> Trend:
    """The trend of one parameter.

    The band is the baseline ± three deviations between the clean runs since it, never narrower than within a
    run. A run on which something was found widens nothing; before there are five, there is no band.

    Args:
        course: of one parameter, at least one model.
        baseline_model: number of the model that counts; None where there is none.
        clean: numbers of the models on whose nights nothing was found, the baseline's included.
        small: the picture without axes, for a list.
    """
    accepted = np.flatnonzero(course.models == (-1 if baseline_model is None else baseline_model))
    band = None
    usual = course.values[np.isin(course.models, list(clean))]
    if len(accepted) and usual.size >= ENOUGH:
        middle = float(course.values[accepted[0]])
        half = BAND * max(float(np.std(usual, ddof=1)), float(course.sigmas[accepted[0]]))
        band = (middle - half, middle + half)
    inside = np.full(len(course.values), True)
    if band is not None:
        inside = (course.values >= band[0]) & (course.values <= band[1])
    rows = () if small else _rows(course, inside)
    kinds = ("small",) if small else ("wide", "narrow")
    picture = Markup("").join(_picture(course, inside, band, kind) for kind in kinds)
    counted = usual.size if len(accepted) else 0
    low, high = band or (None, None)
    return Trend(course.name, course.unit, picture, low, high, counted, rows)


def _rows(course: Course, inside: BoolArray) -> tuple[tuple[int, str, str, str, bool], ...]:
    columns = (course.runs, course.values, course.sigmas, inside)
    lists = [column[::-1].tolist() for column in columns]
    return tuple(
        (run, f"{at:%Y-%m-%d %H:%M}", significant(value, 5), significant(sigma, 2), fine)
        for at, run, value, sigma, fine in zip(reversed(course.at), *lists, strict=True)
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
    begin, end = math.ceil(first.timestamp() / step), math.floor(last.timestamp() / step)
    times = [datetime.fromtimestamp(step * k, UTC) for k in range(begin, end + 1)]
    return [(time, time.strftime(words)) for time in times[: most + 1]] or [(first, first.strftime(words))]


def _picture(course: Course, inside: BoolArray, band: tuple[float, float] | None, kind: str) -> Markup:
    small = kind == "small"
    width, height = _SIZES[kind]
    left, bottom, top = (4, 4, 4) if small else (_LEFT, _BOTTOM, _TOP)
    t0, t1 = float(course.seconds[0]), float(course.seconds[-1])
    axis = axis_of(course.values, course.sigmas, band)

    def x(time: Any) -> Any:
        share = 0.5 + 0.0 * time if t1 == t0 else (time - t0) / (t1 - t0)
        return left + 6 + share * (width - left - 14)

    def y(value: Any) -> Any:
        return top + (axis[1] - value) / (axis[1] - axis[0]) * (height - top - bottom)

    ends = f"from {significant(float(course.values[0]))} to {significant(float(course.values[-1]))}"
    label = f"{escape(course.name)}: {len(course.values)} runs, {ends}"
    parts = [f'<svg class="trend {kind}" viewBox="0 0 {width} {height}" role="img" aria-label="{label}">']
    if band is not None:
        parts.append(
            f'<rect class="band" x="{left}" width="{width - left - 4}" y="{y(band[1]):.1f}" '
            f'height="{max(y(band[0]) - y(band[1]), 1):.1f}"/>'
        )
    across, along = x(course.seconds).tolist(), y(course.values).tolist()
    if not small:
        parts += _axes(kind, axis, (course.at[0], course.at[-1]), x, y)
        ends_of = (
            across,
            y(course.values + course.sigmas).tolist(),
            y(course.values - course.sigmas).tolist(),
        )
        bars = "".join(f"M{a:.1f} {b:.1f}V{c:.1f}" for a, b, c in zip(*ends_of, strict=True))
        parts.append(f'<path class="sigma" d="{bars}"/>')
    path = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, along, strict=True))
    parts.append(f'<polyline class="line" points="{path}"/>')
    marked = list(zip(across, along, inside.tolist(), strict=True))
    parts += [_mark(*one) for one in (marked[-1:] if small else marked)]
    parts.append("</svg>")
    return Markup("".join(parts))  # noqa: S704 (numbers, and a name that was escaped)


def _mark(x: float, y: float, inside: bool) -> str:
    """A dot, or a diamond for who does not see the colour."""
    if inside:
        return f'<circle class="in" cx="{x:.1f}" cy="{y:.1f}" r="3"/>'
    return f'<path class="out" d="M{x:.1f} {y - 5:.1f}l5 5-5 5-5-5z"/>'


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
