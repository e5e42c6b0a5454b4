"""What warmth may make of a change, and what is forgiven: prior → posterior for the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.drift.history import Expected, Series, label_of
from ident.drift.naming import UNEXPLAINED, Explained
from ident.drift.patterns import WARMTH, Pattern, warmth_share
from ident.drift.values import Course, DriftSettings, NamedChange, Usual
from ident.drift.watch import Chart, Watch

_YEAR = 2.0
"""Deviations of a hall's warmth that its seasons make."""
_UPPER = 3.0
"""Deviations above the mean that a coefficient of friction may have at most."""


def with_kelvin(change: NamedChange, settings: DriftSettings) -> NamedChange:
    """A change of friction with the least warmth that would make it: at the largest likely coefficient."""
    if change.effect == WARMTH:
        return replace(change, kelvin=change.size)
    share, sigma = warmth_share(change.effect, settings)
    if not share or change.relative is None:
        return change
    return replace(change, kelvin=change.relative / (share + _UPPER * sigma))


def is_doubtful(changes: Sequence[NamedChange], measured: bool, settings: DriftSettings) -> bool:
    """Whether warmth may be all of a change.

    Without a thermometer: where every named change is one of friction that the warmth of a hall can make. All
    gears together are warmth whenever they are named.
    """
    if not changes:
        return False
    if all(change.effect == WARMTH for change in changes):
        return True
    return not measured and all(_least_kelvin(change) <= settings.possible_warmth for change in changes)


def is_own_warmth(
    explained: Explained, pattern: Pattern | None, amount: float, measured: bool, settings: DriftSettings
) -> bool:
    """Whether all that has moved is friction, by no more than warmth that nobody measured makes of it.

    Args:
        explained: what was named, and what that leaves.
        pattern: the effect that the alarm is of, where nothing was named; None for all parameters.
        amount: of it.
        measured: whether there is a thermometer.
        settings: coefficients, and the warmth of hall and gear.
    """
    if explained.changes:
        moved = [(change.effect, change.size, change.relative) for change in explained.changes]
        if explained.unexplained.p_value < UNEXPLAINED:
            return False
    elif pattern is not None:
        moved = [(pattern.effect, amount, amount / pattern.scale if pattern.scale else None)]
    else:
        return False
    return all(_is_within(*one, measured, settings) for one in moved)


def _is_within(
    effect: str, size: float, relative: float | None, measured: bool, settings: DriftSettings
) -> bool:
    """What a gear's own warmth makes, and what the year of a hall makes of it beyond what all gears share."""
    if effect == WARMTH:
        return abs(size) <= (settings.thermometer_sigma if measured else settings.hall_sigma)
    share, sigma = warmth_share(effect, settings)
    limit = np.hypot(share * settings.gear_sigma, 0.0 if measured else _YEAR * sigma * settings.hall_sigma)
    return relative is not None and abs(relative) <= limit


def _least_kelvin(change: NamedChange) -> float:
    """Warmth that would make a change, K, at the least that the change may be; infinite where none does."""
    if change.kelvin is None or change.size == 0.0:
        return np.inf
    return abs(change.kelvin) * max(0.0, 1.0 - 2.0 * change.sigma / abs(change.size))


def usual_of(watched: Watch, expected: Expected) -> tuple[Usual, ...]:
    """What is usual of each chart, and what tonight might have been off by."""
    return tuple(
        _usual(watched, expected, k, chart, float(watched.allowed[k]))
        for k, chart in enumerate(watched.charts)
    )


def _usual(watched: Watch, expected: Expected, k: int, chart: Chart, allowed: float) -> Usual:
    scale, unit = _scale(chart)
    predicted = watched.predicted
    usual = Usual(
        chart.words,
        unit,
        float(predicted.prior_sigma[k]) * abs(scale),
        float(predicted.sigma[k]) * abs(scale),
        float(predicted.interval[0, k]) * abs(scale),
        float(predicted.interval[1, k]) * abs(scale),
        allowed * abs(scale),
    )
    if not watched.measured or chart.pattern.scale is None:
        return usual
    place = int(np.argmax(np.abs(chart.direction)))
    per = scale / float(chart.direction[place])
    prior = expected.prior
    return replace(
        usual,
        prior_per_kelvin=float(prior.slope[place]) * per,
        prior_per_kelvin_sigma=abs(float(np.sqrt(prior.slope_covariance[place, place])) * per),
        per_kelvin=float(expected.slopes[place]) * per,
        per_kelvin_sigma=abs(float(expected.slope_sigma[place]) * per),
    )


def _scale(chart: Chart) -> tuple[float, str]:
    """Factor to the unit that a reader is shown."""
    scale = chart.pattern.scale
    if chart.unit == "1":
        return 100.0, "%"
    if scale is not None and np.abs(scale) > 0.0:
        return 100.0 / scale, "%"
    return 1.0, chart.unit


def course_of(watched: Watch, series: Series, changes: Sequence[NamedChange]) -> Course:
    """The chart of what was named first; where nothing was, the one that is nearest its limit."""
    words = [chart.pattern.words for chart in watched.charts]
    if changes and changes[0].words in words:
        k = words.index(changes[0].words)
    else:
        k = int(np.argmax(np.abs(watched.scores[-1])))
    scale, unit = _scale(watched.charts[k])
    slope = watched.predicted.slope[k]
    warm = watched.celsius[:, k]
    amount = (watched.series[:, k] - slope * (warm - warm[0])) * scale
    expected = amount[-1] - watched.predicted.error[-1, k] * scale
    allowed = float(watched.allowed[k]) * abs(scale)
    return Course(
        watched.charts[k].words,
        unit,
        tuple(label_of(night) for night in series.nights),
        series.day - series.day[0],
        amount - amount[0],
        tuple(bool(night.clean) for night in series.nights),
        float(expected - amount[0] - allowed),
        float(expected - amount[0] + allowed),
    )
