"""The report's pictures over time: measured and predicted, with their difference in a strip below."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from hashlib import sha256
from importlib.resources import files

import numpy as np

from daq.report.parameters import joint_heading
from daq.report.pictures import Tick, end_to_end, nice_ticks, scaled, tick_text, trace_path
from daq.text.numbers import significant
from robots.arrays import FloatArray, IntArray

_POINTS_PER_PAGE = 6000
_MOST_PIXELS = 500
_POSITION_PIXELS = 150
"""Columns of a position: it is smooth, and its page shows torques as well."""
PLOTS = files("daq").joinpath("templates", "plots.js").read_text(encoding="utf-8")
"""Cursor and zoom of the pictures, where a browser runs it."""
_HASH = b64encode(sha256(PLOTS.encode()).digest()).decode()
POLICY = f"default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src 'sha256-{_HASH}'"
"""What a report may do in a browser: this one script, and nothing from elsewhere (CSP level 3, 2.3.1)."""


@dataclass(frozen=True)
class Panel:
    """One plot area: paths in plot units, labels of its vertical axis in percent from the top, its range."""

    paths: tuple[str, ...]
    ticks: tuple[Tick, ...]
    limits: tuple[float, float]


@dataclass(frozen=True)
class TraceFigure:
    """Two traces over time and their difference, of one joint."""

    heading: str
    unit: str
    numbers: tuple[tuple[str, str], ...]
    description: str
    main: Panel
    difference: Panel
    time_ticks: tuple[Tick, ...]
    capture_starts: tuple[float, ...]
    span: tuple[float, float]
    """s at the left and at the right."""


def pixels_per_trace(traces: int) -> int:
    """Columns that each trace may use so that the page stays small."""
    return max(40, min(_MOST_PIXELS, _POINTS_PER_PAGE // max(traces, 1)))


def trace_figure(
    heading: str,
    unit: str,
    numbers: tuple[tuple[str, str], ...],
    time: FloatArray,
    measured: FloatArray,
    predicted: FloatArray,
    pixels: int,
) -> TraceFigure:
    """One joint's picture.

    Args:
        heading: the joint.
        unit: of both traces.
        numbers: labelled figures that belong to the picture.
        time: (N,) s; a smaller value than the one before starts another capture.
        measured: (N,).
        predicted: (N,).
        pixels: columns to reduce each trace to.
    """
    along, starts = end_to_end(time)
    t0, t1 = (float(along[0]), float(along[-1])) if along.size else (0.0, 1.0)
    if t1 <= t0:
        t1 = t0 + 1.0
    difference = measured - predicted
    low, high = _range(np.r_[measured, predicted])
    far = max(abs(bound) for bound in _range(difference))
    ticks = nice_ticks(t0, t1, 5)
    text = "; ".join(f"{label} {value}" for label, value in numbers)
    return TraceFigure(
        heading=heading,
        unit=unit,
        numbers=numbers,
        description=f"{heading}: measured and predicted, in {unit}, over {t1 - t0:.3g} s. {text}",
        main=_panel((measured, predicted), along, starts, (t0, t1, low, high), pixels, 3),
        difference=_panel((difference,), along, starts, (t0, t1, -far, far), pixels, 3),
        time_ticks=tuple(Tick(scaled(t, (t0, t1)), tick_text(t, ticks)) for t in ticks),
        capture_starts=tuple(scaled(float(along[k]), (t0, t1)) for k in starts.tolist()),
        span=(t0, t1),
    )


def position_figure(
    joint: int, name: str, unit: str, time: FloatArray, measured: FloatArray, reference: FloatArray
) -> TraceFigure:
    """Position of one joint beside its reference, with the following error in the strip below.

    Args:
        joint: from 0.
        name: of the joint.
        unit: of the position.
        time: (N,) s; a smaller value than the one before starts another capture.
        measured, reference: (N,).
    """
    error = reference - measured
    far = float(np.nanmax(np.abs(error))) if np.isfinite(error).any() else 0.0
    numbers = (("largest following error", f"{significant(far)} {unit}"),)
    return trace_figure(
        joint_heading(joint, name), unit, numbers, time, measured, reference, _POSITION_PIXELS
    )


def _range(values: FloatArray) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    margin = 0.06 * (high - low) or abs(high) or 1.0
    return low - margin, high + margin


def _panel(
    traces: tuple[FloatArray, ...],
    time: FloatArray,
    starts: IntArray,
    window: tuple[float, float, float, float],
    pixels: int,
    least: int,
) -> Panel:
    _, _, low, high = window
    values = nice_ticks(low, high, least)
    ticks = tuple(Tick(100.0 - scaled(v, (low, high)), tick_text(v, values)) for v in values)
    paths = tuple(trace_path(time, trace, window, pixels, starts) for trace in traces)
    return Panel(paths, ticks, (low, high))
