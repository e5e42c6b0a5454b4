"""The report's pictures: small functions that return inline SVG or the numbers a template places.

Horizontal positions are percentages of the picture, so that a picture fits a phone and a desktop while
its text, dots and lines keep their size. Colours come from the style sheet through class names; a mark's
shape says the same as its colour. Everything returned is made of numbers and fixed words.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from markupsafe import Markup

from daq.text.numbers import significant
from robots.arrays import FloatArray, IntArray

PLOT_WIDTH = 1000
PLOT_HEIGHT = 400
GateState = Literal["open", "closed", "exit", "none"]


@dataclass(frozen=True)
class Tick:
    """One axis label: position in percent from the left (or the top) and its text."""

    at: float
    text: str


def nice_ticks(low: float, high: float, least: int) -> list[float]:
    """Round numbers inside [low, high], at least so many: multiples of 1, 2 or 5 times a power of ten."""
    span = high - low
    if not (math.isfinite(span) and span > 0):
        return [low]
    power = 10.0 ** math.floor(math.log10(span))
    for step in (power * factor for factor in (5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05)):
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if last - first + 1 >= least:
            break
    return [k * step for k in range(first, last + 1)]


def tick_text(value: float, ticks: list[float]) -> str:
    """A tick's number with as many digits as the step between ticks needs, so that no two read the same."""
    step = ticks[1] - ticks[0] if len(ticks) > 1 else abs(value) or 1.0
    decimals = max(0, -math.floor(math.log10(step) + 1e-9)) if step > 0 else 0
    if decimals > 4 or abs(value) >= 1e6:
        largest = max(abs(tick) for tick in (value, *ticks))
        digits = math.floor(math.log10(largest)) - math.floor(math.log10(step) + 1e-9) + 1 if largest else 1
        return "0" if abs(value) < 1e-9 * step else significant(value, max(digits, 1))
    text = f"{value:.{decimals}f}"
    return ("0" if float(text) == 0 else text).replace("-", "−")


def extremes(time: FloatArray, values: FloatArray, pixels: int) -> IntArray:
    """Indices that draw a trace as seen at ``pixels`` columns: first, least, greatest and last of each.

    A spike of one sample survives, which plain down-sampling would lose. Samples that are not finite are
    left out. Shapes: time (N,), values (N,) → (≤ 4·pixels,), ascending.
    """
    finite = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    if finite.size <= 2 * pixels:
        return finite
    at = time[finite]
    span = float(at[-1] - at[0]) or 1.0
    column = np.minimum(((at - at[0]) / span * pixels).astype(np.int64), pixels - 1)
    starts = np.flatnonzero(np.r_[True, np.diff(column) != 0])
    ends = np.r_[starts[1:], finite.size]
    kept: list[int] = [0, int(finite.size) - 1]
    for start, end in zip(starts, ends, strict=True):
        block = values[finite[start:end]]
        kept += [int(start) + int(np.argmin(block)), int(start) + int(np.argmax(block))]
    return finite[np.unique(kept)]


def trace_path(
    time: FloatArray,
    values: FloatArray,
    window: tuple[float, float, float, float],
    pixels: int,
    starts: IntArray | None = None,
) -> str:
    """The ``d`` of an SVG path for one trace, in plot units (1000 × 400), broken where samples lack.

    Args:
        time: (N,) ascending.
        values: (N,), NaN where there is nothing.
        window: time and value ranges (t0, t1, v0, v1) that fill the plot.
        pixels: columns to reduce the trace to.
        starts: indices where another capture begins; the line is broken there too.
    """
    t0, t1, v0, v1 = window
    index = extremes(time, values, pixels)
    if index.size == 0:
        return ""
    broken = (~np.isfinite(values)).astype(np.int64)
    if starts is not None:
        broken[starts] += 1
    pen_up = np.diff(np.cumsum(broken)[index]) > 0
    x = np.rint((time[index] - t0) / (t1 - t0) * PLOT_WIDTH).astype(int)
    y = np.rint((v1 - values[index]) / (v1 - v0) * PLOT_HEIGHT).astype(int)
    parts = [f"M{x[0]} {y[0]}"]
    for dx, dy, up in zip(np.diff(x).tolist(), np.diff(y).tolist(), pen_up.tolist(), strict=True):
        if up:
            parts.append(f"m{dx} {dy}")
        elif dx == 0 and dy != 0:
            parts.append(f"v{dy}")
        elif dx != 0 and dy == 0:
            parts.append(f"h{dx}")
        elif dx != 0:
            parts.append(f"l{dx} {dy}" if dy > 0 else f"l{dx}{dy}")
    return "".join(parts)


def end_to_end(time: FloatArray) -> tuple[FloatArray, IntArray]:
    """Times of several captures laid one after the other, and the indices where a new one starts.

    Rows of joined captures start again at a smaller time; such a step becomes one ordinary step.
    """
    steps = np.diff(time)
    starts = np.flatnonzero(steps < 0) + 1
    ordinary = float(np.median(steps[steps > 0])) if bool(np.any(steps > 0)) else 1.0
    shifted = np.r_[0.0, np.cumsum(np.where(steps < 0, ordinary, steps))] + (time[0] if time.size else 0.0)
    return np.asarray(shifted, dtype=np.float64), starts.astype(np.int64)


def scaled(value: float, limits: tuple[float, float], logarithmic: bool = False) -> float:
    """Position of a value on an axis, in percent, held inside the picture."""
    low, high = limits
    if logarithmic:
        low, high, value = math.log(low), math.log(high), math.log(max(value, low))
    return float(min(max(100.0 * (value - low) / (high - low), 0.0), 100.0))


Shape = Literal["circle", "diamond", "square", "tick", "left", "right"]
_SHAPES: dict[Shape, str] = {
    "circle": "M-4 0a4 4 0 1 1 8 0a4 4 0 1 1-8 0z",
    "diamond": "M0-5.5 5.5 0 0 5.5-5.5 0z",
    "square": "M-3.2-3.2h6.4v6.4h-6.4z",
    "tick": "M0-8V8",
    "left": "M1-4.5-5 0 1 4.5z",
    "right": "M-1-4.5 5 0-1 4.5z",
}


def mark(x: float, shape: Shape, style: str, y: int = 9) -> str:
    """One mark of a row picture, centred ``x`` percent from the left in a picture 18 px high."""
    return f'<svg class="o" x="{x:.1f}%" y="{y}"><path class="{style}" d="{_SHAPES[shape]}"/></svg>'


_ROW = '<svg class="row" aria-hidden="true">'


def _drawn(*parts: str) -> Markup:
    """Parts of a picture, made of numbers and fixed words alone, as markup that is not escaped again."""
    return Markup("".join(parts))  # noqa: S704


def dot_row(
    size: float, limit: float, limits: tuple[float, float], logarithmic: bool, beyond: bool
) -> Markup:
    """A column's size as a dot beside its limit: a filled circle within it, a diamond beyond it."""
    if not math.isfinite(size):
        return _drawn(_ROW, "</svg>")
    at = scaled(size, limits, logarithmic)
    bound = scaled(limit, limits, logarithmic) if math.isfinite(limit) else 100.0
    dot = mark(at, "diamond", "far") if beyond else mark(at, "circle", "near")
    stem = f'<line class="stem" x1="{bound:.1f}%" x2="{at:.1f}%" y1="9" y2="9"/>' if beyond else ""
    return _drawn(
        _ROW,
        '<line class="axis" x1="0" x2="100%" y1="9" y2="9"/>',
        stem,
        f'<line class="limit" x1="{bound:.1f}%" x2="{bound:.1f}%" y1="0" y2="18"/>',
        dot,
        "</svg>",
    )


def _held(offset: float, shape: Shape, reach: float, style: str, y: int) -> str:
    """A mark at its place, or an arrow at the picture's edge that points to it."""
    if offset < -reach:
        return mark(4.0, "left", style + " fill", y)
    if offset > reach:
        return mark(96.0, "right", style + " fill", y)
    return mark(scaled(offset, (-reach, reach)), shape, style, y)


def forest_row(
    iv_offset: float | None,
    iv_half: float,
    truth_offset: float | None,
    third_offset: float | None = None,
    reach: float = 6.0,
) -> Markup:
    """One parameter's estimates about the LS estimate, in units of the LS standard deviation.

    The LS estimate is the circle in the middle of a band of ±2 σ; the IV estimate is a square with its own
    ±2 σ; a third estimate is a diamond; the truth is an upright tick. What lies beyond ±``reach`` is an
    arrow at the edge.

    Args:
        iv_offset: (IV − LS)/σ_LS, or None.
        iv_half: 2 σ_IV/σ_LS.
        truth_offset: (truth − LS)/σ_LS, or None.
        third_offset: of the robust or the consistent estimate from LS, in σ_LS, or None.
        reach: half the width, in σ_LS.
    """
    band = scaled(-2.0, (-reach, reach))
    parts = [f'<rect class="band" x="{band:.1f}%" width="{100 - 2 * band:.1f}%" y="0" height="18"/>']
    if truth_offset is not None and math.isfinite(truth_offset):
        parts.append(_held(truth_offset, "tick", reach, "truth", 9))
    drawn = iv_offset is not None and math.isfinite(iv_offset) and math.isfinite(iv_half)
    parts.append(mark(50.0, "circle", "ls", 5 if drawn else 9))
    if drawn and iv_offset is not None:
        ends = [scaled(iv_offset + half, (-reach, reach)) for half in (-iv_half, iv_half)]
        if abs(iv_offset) <= reach:
            parts.append(f'<line class="iv" x1="{ends[0]:.1f}%" x2="{ends[1]:.1f}%" y1="14" y2="14"/>')
        parts.append(_held(iv_offset, "square", reach, "iv", 14))
    if third_offset is not None and math.isfinite(third_offset):
        parts.append(_held(third_offset, "diamond", reach, "third", 9))
    return _drawn(_ROW, *parts, "</svg>")


_SWUNG_OPEN = '<path class="leaf" d="M0 -25 27 -37M0 25 27 37"/>'
_SHUT = '<path class="leaf" d="M0 -25V25"/>'
_WALL = '<path class="wall" d="M0 -54V-25M0 25V54"/>'
_POSTS = '<path class="post" d="M-6 -31h12v12h-12zM-6 19h12v12h-12z"/>'
_NO_ENTRY = '<circle class="plate" r="15"/><path class="cross" d="M-6 -6 6 6M6 -6 -6 6"/>'
_END = '<circle class="end" r="12"/><path class="tick" d="M-5 0 -1.5 4 5 -4"/>'


def _placed(at: str, picture: str) -> str:
    return f'<svg class="o" x="{at}" y="54">{picture}</svg>'


def _rail(start: str, end: str, style: str = "rail") -> str:
    return f'<line class="{style}" x1="{start}" x2="{end}" y1="54" y2="54"/>'


def gate_picture(state: GateState, last: bool) -> Markup:
    """A gate in a wall across a track, seen from above: how far the evidence went and where it stopped.

    Args:
        state: open (it went through), closed (it stopped here), exit (through, and nothing left to do
            after it) or none (it never came here).
        last: the third gate, after which the track ends.
    """
    idle = "rail idle"
    if state == "none":
        track, leaves = _rail("0", "100%", idle), _SHUT
    elif state == "closed":
        track, leaves = _rail("50%", "100%", idle) + _rail("0", "50%"), _SHUT
    elif state == "exit" or last:
        beyond = "" if last else _rail("80%", "100%", idle)
        track, leaves = beyond + _rail("0", "80%") + _placed("80%", _END), _SWUNG_OPEN
    else:
        track, leaves = _rail("0", "100%"), _SWUNG_OPEN
    sign = _NO_ENTRY if state == "closed" else ""
    gate = _placed("50%", _WALL + leaves + _POSTS + sign)
    return _drawn(f'<svg class="gate {state}" aria-hidden="true">', track, gate, "</svg>")


_ICONS = {
    "good": '<circle cx="24" cy="24" r="21"/><path d="M14 25 21.5 32.5 35 17"/>',
    "switch": '<circle cx="24" cy="24" r="21"/><path d="M13 19H34L28.5 13.5M35 29H14L19.5 34.5"/>',
    "warn": '<path d="M24 5 45 42H3Z"/><path d="M24 18v12M24 36v.5"/>',
    "bad": '<path d="M15.5 3.5h17l12 12v17l-12 12h-17l-12-12v-17z"/><path d="M16 16 32 32M32 16 16 32"/>',
    "unknown": '<circle cx="24" cy="24" r="21" stroke-dasharray="5 4"/>'
    '<path d="M18 19a6 6 0 1 1 8.5 5.5c-2 1-2.5 2-2.5 4M24 34v.5"/>',
}


def icon(kind: Literal["good", "switch", "warn", "bad", "unknown"]) -> Markup:
    """The verdict's sign: a tick, two arrows, a warning triangle, a stop octagon or a question mark."""
    return _drawn('<svg class="icon" viewBox="0 0 48 48" aria-hidden="true">', _ICONS[kind], "</svg>")
