"""Column by column: what each regressor column says in a gate, as dots beside a limit."""

from __future__ import annotations

import math
from dataclasses import dataclass

from markupsafe import Markup

from daq.report.pictures import Tick, dot_row, nice_ticks, scaled, tick_text
from daq.text.numbers import NOTHING, percent, setting, significant
from ident.verdicts import ColumnCheck, Gate, GateName

_LEAST_P = 1e-6
"""Smaller p-values are drawn at the edge: their distance says nothing more."""
_LEAST_SHARE = 1e-4
"""Smaller sizes are as good as nothing, and drawn at the edge too."""
_LOGARITHMIC_FROM = 30.0
_UNITS: dict[GateName, str] = {"instruments": "%", "rank": "×", "exogeneity": ""}


@dataclass(frozen=True)
class ColumnView:
    """One column: its picture and its figures as text."""

    name: str
    picture: Markup
    size: str
    limit: str
    p_value: str
    beyond: bool


@dataclass(frozen=True)
class ColumnPlot:
    """The dot plot of a gate, worst column first."""

    groups: tuple[tuple[str, tuple[ColumnView, ...]], ...]
    """Columns beyond the limit, then the others, each under its word."""
    worst: ColumnView
    size_name: str
    limit_name: str
    header: str
    summary: str
    ticks: tuple[Tick, ...]
    logarithmic: bool
    has_p: bool


@dataclass(frozen=True)
class _Words:
    worst: str
    limit: str
    header: str
    within: str
    beyond: str


_WORDS: dict[GateName, _Words] = {
    "instruments": _Words("Largest departure", "margin", "Size", "accepted", "beyond margin"),
    "rank": _Words("Largest |Rₖₖ|", "its noise floor", "Times floor", "null", "to test"),
    "exogeneity": _Words("Smallest p", "limit", "p", "exogenous", "endogenous"),
}


@dataclass(frozen=True)
class _Point:
    """A column on its gate's axis: a share of the column, a multiple of its floor, or a p-value."""

    name: str
    at: float
    limit: float
    p_value: float | None
    beyond: bool


def column_plot(gate: Gate) -> ColumnPlot | None:
    """The dot plot of a gate's columns, or None where it has none.

    Gate 1 shows the size of each departure against the margin; gate 2 |R_kk| as a multiple of the column's
    own noise floor; gate 3 the p-value of each column against its limit, where small is bad.
    """
    if not gate.columns:
        return None
    words = _WORDS[gate.name]
    points = [_point(check, gate.name) for check in gate.columns]
    points.sort(key=lambda point: _from_bad_to_good(point, gate.name))
    limits, logarithmic = _axis(points, gate.name)
    views = [_view(point, gate.name, limits, logarithmic) for point in points]
    beyond = tuple(view for view in views if view.beyond)
    within = tuple(view for view in views if not view.beyond)
    return ColumnPlot(
        groups=tuple(group for group in ((words.beyond, beyond), (words.within, within)) if group[1]),
        worst=views[0],
        size_name=words.worst,
        limit_name=words.limit,
        header=words.header,
        summary=f"{len(views)} columns, {len(beyond) or 'none'} {words.beyond}",
        ticks=_ticks(limits, logarithmic, gate.name),
        logarithmic=logarithmic,
        has_p=gate.name != "exogeneity" and any(point.p_value is not None for point in points),
    )


def _point(check: ColumnCheck, gate: GateName) -> _Point:
    if gate == "rank":
        ratio = check.size / check.limit if check.limit > 0 else math.inf if check.size > 0 else 0.0
        return _Point(check.column, ratio, 1.0, check.p_value, check.size > check.limit)
    return _Point(check.column, check.size, check.limit, check.p_value, not check.passed)


def _from_bad_to_good(point: _Point, gate: GateName) -> tuple[bool, float]:
    if not math.isfinite(point.at):
        return not point.beyond, -math.inf
    return not point.beyond, point.at if gate == "exogeneity" else -point.at


def _view(point: _Point, gate: GateName, limits: tuple[float, float], logarithmic: bool) -> ColumnView:
    held = min(point.at, limits[1]) if not math.isnan(point.at) else point.at
    return ColumnView(
        name=point.name,
        picture=dot_row(held, point.limit, limits, logarithmic, point.beyond),
        size=_number(point.at, gate),
        limit=_limit(point.limit, gate),
        p_value=_small(point.p_value),
        beyond=point.beyond,
    )


def _number(value: float, gate: GateName) -> str:
    if gate == "exogeneity":
        return _small(value)
    if 0.0 <= value < _LEAST_SHARE:
        least = 100.0 * _LEAST_SHARE if gate == "instruments" else _LEAST_SHARE
        return f"<\u00a0{least:g}\u00a0{_UNITS[gate]}"
    return percent(100.0 * value) if gate == "instruments" else f"{significant(value)}\u00a0×"


def _limit(value: float, gate: GateName) -> str:
    if gate == "instruments":
        return f"{setting(100.0 * value)}\u00a0%"
    return "1\u00a0×" if gate == "rank" else significant(value, 2)


def _small(p_value: float | None) -> str:
    if p_value is None or math.isnan(p_value):
        return NOTHING
    return "<\u00a00.0001" if p_value < 1e-4 else significant(p_value, 2)


def _axis(points: list[_Point], gate: GateName) -> tuple[tuple[float, float], bool]:
    """Range of the dot plot, and whether it is logarithmic: p-values, and sizes over a factor of 30."""
    if gate == "exogeneity":
        return (_LEAST_P, 1.0), True
    values = [v for point in points for v in (point.at, point.limit) if math.isfinite(v) and v > 0.0]
    if not values:
        return (0.0, 1.0), False
    low, high = min(values), max(values)
    if high / low > _LOGARITHMIC_FROM and gate == "rank":
        return (max(low, _LEAST_SHARE), high * 1.5), True
    return (0.0, high * 1.1), False


def _ticks(limits: tuple[float, float], logarithmic: bool, gate: GateName) -> tuple[Tick, ...]:
    suffix = f"\u00a0{_UNITS[gate]}" if _UNITS[gate] else ""
    factor = 100.0 if gate == "instruments" else 1.0
    if not logarithmic:
        scale = (factor * limits[0], factor * limits[1])
        values = nice_ticks(*scale, 2)
        return tuple(Tick(scaled(v, scale), tick_text(v, values) + suffix) for v in values)
    first, last = math.ceil(math.log10(limits[0])), math.floor(math.log10(limits[1]))
    step = max(1, math.ceil((last - first + 1) / 3))
    return tuple(
        Tick(scaled(10.0**k, limits, True), significant(factor * 10.0**k, 1).removeprefix("1·") + suffix)
        for k in range(last, first - 1, -step)
    )
