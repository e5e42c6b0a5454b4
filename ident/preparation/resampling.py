"""Samples as a log has them, brought to an even grid: jitter, late stamps, samples that are missing.

Positions are smooth, so they say which clock is right. Where they are smoother by their time stamps, the
samples were taken at those times and a cubic spline through them gives the grid. Where they are smoother by
their number, they were taken evenly and only stamped late: then the even clock is used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ident.errors import IdentificationError
from ident.listing import seconds
from ident.ordered import median, percentile
from ident.recording import JITTER_ALLOWED, Recording
from robots.arrays import BoolArray, FloatArray, IntArray

_COST = 0.01
"""Share of the motion that a spline across a gap may lose; beyond it, the recording is cut there."""
_SPLINE = 5.0 / 384.0
"""Error of a cubic spline of spacing h: at most this times h⁴ times the fourth derivative (Hall, Meyer)."""
_MOTION = 0.2
"""Of the cut-off: the bandwidth of the motion, by the rule that proposes cut-offs."""
_NEAR = 9
"""Samples among which the middle one says how many are missing before."""
_FEW = 64
"""Samples by whose phases the clock is found."""
_FAR_SMOOTHER = 0.5
"""Times the roughness of positions by their stamps, below which stamps do not say when they were taken."""
_BACK = 2.0
"""Periods by which stamps may be out of order where the number of samples says when they were taken."""


@dataclass(frozen=True)
class Uniform:
    """An even recording.

    Attributes:
        recording: M samples.
        there: (M,) whether a sample is near; False inside gaps that no spline can fill.
        words: what was done, as sentences of warning.
        beside: further channels by name, M × n each.
    """

    recording: Recording
    there: BoolArray
    words: tuple[str, ...]
    beside: Mapping[str, FloatArray] = field(default_factory=dict)


def uniform_recording(
    name: str,
    time: FloatArray,
    reference: FloatArray | None,
    position: FloatArray,
    control_signal: FloatArray,
    cutoff_hz: float,
    beside: Mapping[str, FloatArray] | None = None,
) -> Uniform:
    """A recording from samples that need not be evenly spaced.

    Evenly spaced samples pass unchanged. Otherwise all channels are interpolated by cubic splines on an even
    grid of the same clock, and a sentence says so and what that costs at the cut-off.

    Args:
        name: for messages.
        time: (samples,) s.
        reference: samples × joints, rad (or m); None where it was not recorded.
        position: samples × joints, rad (or m).
        control_signal: samples × drives.
        cutoff_hz: of the low-pass for the positions.
        beside: further channels by name, samples × n each.

    Raises:
        IdentificationError: too few samples, or time that goes back; says where, and what to do.
    """
    if time.shape[0] < 3:
        raise IdentificationError(f"{name}: {time.shape[0]} samples are too few to identify")
    steps = np.diff(time)
    period = median(steps)
    if period > 0 and np.abs(steps - period).max() <= JITTER_ALLOWED * period:
        everywhere = np.ones(len(time), dtype=np.bool_)
        return Uniform(
            Recording(name, time, reference, position, control_signal), everywhere, (), beside or {}
        )
    clock = clock_of(name, time, position)
    taken, period = clock.taken, clock.period
    grid = taken[0] + period * np.arange(int((taken[-1] - taken[0]) / period + 1e-6) + 1)
    resampled = [
        None if values is None else _on_grid(grid, taken, values)
        for values in (reference, position, control_signal)
    ]
    assert resampled[1] is not None
    assert resampled[2] is not None
    recording = Recording(name, grid, resampled[0], resampled[1], resampled[2])
    there = _there(grid, taken, cutoff_hz)
    more = {channel: _on_grid(grid, taken, values) for channel, values in (beside or {}).items()}
    return Uniform(recording, there, _said(name, clock, there, cutoff_hz), more)


@dataclass(frozen=True)
class Clock:
    """When the samples of a log were taken.

    Attributes:
        taken: (samples,) s.
        period: of the even clock nearest to them, s.
        number: (samples,) the place of each on that clock.
        jitter: s; by how much stamps are off it at most.
        stamped: whether the samples were taken at their stamps, not evenly.
    """

    taken: FloatArray
    period: float
    number: FloatArray
    jitter: float
    stamped: bool


def clock_of(name: str, time: FloatArray, position: FloatArray) -> Clock:
    """When samples were taken, by their stamps and by the positions, which are smooth.

    Args:
        name: for messages.
        time: (samples,) s, three or more.
        position: samples × joints.

    Raises:
        IdentificationError: time goes back, or stands.
    """
    steps = np.diff(time)
    number, period = _numbered(name, time, steps)
    number, period = _smoother(time, position, number, period)
    even = time[0] + period * number
    even += median(time - even)
    jitter = float(np.abs(time - even).max())
    on_clock = jitter <= JITTER_ALLOWED * period
    rising = bool((steps > 0).all())
    stamped = rising and (on_clock or _roughness(time, position) <= _roughness(even, position))
    return Clock(time if stamped else even, period, number, jitter, stamped)


def _numbered(name: str, time: FloatArray, steps: FloatArray) -> tuple[FloatArray, float]:
    """The place of each sample on an even clock, and its period.

    Raises:
        IdentificationError: time goes back, or stands.
    """
    none = np.arange(len(time), dtype=np.float64)
    whole = float(time[-1] - time[0]) / len(steps)
    back = np.flatnonzero(steps <= 0)
    if back.size:
        coarse = float(percentile(steps[steps > 0], 99.0)) if whole > 0 else 0.0
        if whole > 0 and np.abs(time - time[0] - whole * none).max() <= max(_BACK * whole, coarse):
            return none, whole
        at = int(back[0])
        raise IdentificationError(
            f"{name}: time does not increase after {seconds(time[at])} s (sample {at}), {back.size} times in"
            " all; cut the log there, or give its sampling rate instead"
        )
    period, start = _clock(time, median(steps))
    place = (time - start) / period - none
    missing = np.rint(place).astype(np.int64)
    if (np.diff(missing) < 0).any():  # what jitters comes back, what is missing does not
        from scipy.ndimage import median_filter  # takes time to load; an even log needs none

        missing = np.rint(median_filter(place, _NEAR, mode="nearest")).astype(np.int64)
    missing = np.minimum.accumulate(missing[::-1])[::-1]
    some = none + missing - missing[0]
    whole = float(np.polyfit(none, time, 1)[0])
    if _off(time, none, whole) <= _off(time, some, period):
        return none, whole
    return np.asarray(some, dtype=np.float64), period


def _smoother(
    time: FloatArray, position: FloatArray, number: FloatArray, period: float
) -> tuple[FloatArray, float]:
    """The even clock without any missing sample, where positions are far smoother on it.

    What reads a slower source at a rate of its own meets some samples twice: without these, stamps have gaps
    that the samples do not have.
    """
    none = np.arange(len(time), dtype=np.float64)
    if number[-1] == none[-1]:
        return number, period
    whole, steps = float(np.polyfit(none, time, 1)[0]), np.diff(number)
    gap = np.flatnonzero(steps > steps.min())[:, np.newaxis] + np.arange(
        -1, 3
    )  # which have it among their five
    near = np.unique(np.clip(gap, 2, len(time) - 3)) - 2
    with_gaps, without = (_roughness(clock, position, near) for clock in (period * number, whole * none))
    return (none, whole) if without < _FAR_SMOOTHER * with_gaps else (number, period)


def _off(time: FloatArray, number: FloatArray, period: float) -> float:
    return float(np.std(time - period * number))


def _clock(time: FloatArray, near: float) -> tuple[float, float]:
    """Period and start of the clock that samples keep to: by the phases of a few, then by more and more."""
    few = time[: min(_FEW, len(time))] - time[0]
    tried = near * np.linspace(0.8, 1.25, 50 * len(few))
    period = float(tried[np.argmax(np.abs(np.exp(2j * np.pi * few / tried[:, np.newaxis]).sum(axis=1)))])
    start, count = float(time[0]), len(few)
    while True:
        part = time[:count]
        number = np.rint((part - start) / period)
        period, start = (float(x) for x in np.polyfit(number, part, 1))
        if count == len(time):
            return period, start
        count = min(2 * count, len(time))


def _roughness(time: FloatArray, position: FloatArray, at: IntArray | None = None) -> float:
    """How far samples are from the cubic through their two neighbours on each side: the median over samples,
    those ``at`` from the third one on where given, each joint beside how much it moves from sample to sample.
    """
    nodes = [time[k : len(time) - 4 + k] for k in range(5)]
    guess = np.zeros_like(position[2:-2])
    for k in (0, 1, 3, 4):
        weight = np.ones(len(guess))
        for other in (0, 1, 3, 4):
            if other != k:
                weight *= (nodes[2] - nodes[other]) / (nodes[k] - nodes[other])
        guess += weight[:, np.newaxis] * position[k : len(time) - 4 + k]
    off = np.abs(position[2:-2] - guess)
    off = np.median(off if at is None else off[at], axis=0)
    step = np.mean(np.abs(np.diff(position, axis=0)), axis=0)
    moved = step > 0
    return float(np.mean(off[moved] / step[moved])) if moved.any() else 0.0


def _on_grid(grid: FloatArray, time: FloatArray, values: FloatArray) -> FloatArray:
    """By a cubic spline; beyond the ends the last sample, not what a cubic does there."""
    from scipy.interpolate import CubicSpline  # takes time to load; an even log needs none

    within = np.clip(grid, time[0], time[-1])
    found = np.empty((grid.size, values.shape[1]))
    for k, column in enumerate(values.T):  # one by one: the polynomials are four times the samples
        found[:, k] = CubicSpline(time, column)(within)
    return found


def _loss(step: float, frequency: float) -> float:
    """Share of a sine of that frequency that a cubic spline of that spacing can lose."""
    return float(_SPLINE * (2 * np.pi * frequency * step) ** 4)


def longest_gap(cutoff_hz: float) -> float:
    """s; between two samples that a spline may join."""
    return float((_COST / _SPLINE) ** 0.25 / (2 * np.pi * _MOTION * cutoff_hz))


def _there(grid: FloatArray, time: FloatArray, cutoff_hz: float) -> BoolArray:
    after = np.clip(np.searchsorted(time, grid), 1, len(time) - 1)
    gap = time[after] - time[after - 1]
    period = (grid[-1] - grid[0]) / (len(grid) - 1)
    inside = np.minimum(grid - time[after - 1], time[after] - grid) > 0.75 * period
    return np.asarray(~((gap > longest_gap(cutoff_hz)) & inside), dtype=np.bool_)


def _said(name: str, clock: Clock, there: BoolArray, cutoff_hz: float) -> tuple[str, ...]:
    """How the samples stand in time, and what was done about it."""
    taken, period, number = clock.taken, clock.period, clock.number
    off = f"{1e3 * clock.jitter:.2g} ms"
    parts = []
    if not clock.stamped:
        parts.append(f"time stamps are up to {off} off the even clock that the positions keep to")
    elif clock.jitter > JITTER_ALLOWED * period:
        parts.append(f"samples are up to {off} off an even clock")
    missing = np.diff(number).astype(np.int64) - 1
    if missing.any():
        at = taken[int(np.argmax(missing))]
        total = int(number[-1]) + 1
        parts.append(
            f"{int(missing.sum())} of {total} samples are missing, {missing.max()} in a row after"
            f" {seconds(at)} s"
        )
    steps = np.diff(taken)
    joined = steps[steps <= max(longest_gap(cutoff_hz), period)]
    cost = 100 * _loss(float(joined.max(initial=period)), cutoff_hz)
    words = f"{name}: resampled every {1e3 * period:.4g} ms by cubic splines"
    words += f", which loses at most {min(cost, 100.0):.3g} % at {cutoff_hz:g} Hz"
    if not there.all():
        count = int(np.count_nonzero(steps > longest_gap(cutoff_hz)))
        words += f"; cut at {count} gap{'s' * (count > 1)} longer than {1e3 * longest_gap(cutoff_hz):.3g} ms"
    return (*((f"{name}: {', '.join(parts)}",) if parts else ()), words)
