"""The charts of one arm: one per effect and place, each judged against the arm's own nights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.drift.charts import (
    budget_per_night,
    cusum,
    normal_scores,
    one_night_threshold,
    trend_threshold,
)
from ident.drift.geometry import Geometry
from ident.drift.patterns import WARMTH, Pattern, warmth_share
from ident.drift.predictive import ChartPrior, Predicted, predict
from ident.drift.prior import NightPrior, largest_share
from ident.drift.run_to_run import Recursive, recursive_residuals
from ident.drift.values import Alarm, DriftSettings
from ident.drift.wald import solve_covariance
from ident.drift.warmth import warmth_of_gears
from robots.arrays import BoolArray, FloatArray

OTHER = "anything else"
_DOUBT, _SERIOUS_DOUBT = 3.0, 1.5
"""Scores at which a change beyond the tolerance, and beyond twice the tolerance, is told: the larger it is,
the less has to speak for it."""


@dataclass(frozen=True)
class Chart:
    """One effect at one place, or one of its amounts.

    Attributes:
        words: for an operator.
        pattern: the effect.
        direction: (b,) change of the parameters per unit.
        unit: of the amount.
    """

    words: str
    pattern: Pattern
    direction: FloatArray
    unit: str


@dataclass(frozen=True)
class Watch:
    """The charts over all nights.

    Attributes:
        charts: c of them.
        series: (N, c) amount of each effect, as if nothing else had moved.
        celsius: (N, c) temperature that belongs to each: of the thermometers, or what the friction of the
            other gears makes of it, K beside any zero.
        measured: whether thermometers say it.
        prior: of each chart.
        predicted: each night beside what those before make of it.
        up, down: (N, c) CUSUMs.
        other: (N,) scores of the size of what is left in all parameters; nan before it is known.
        one_night, trend, other_threshold: thresholds.
        allowed: (c,) how far the last night may be above its prediction without an alarm of that night.
        alarms: of the last night.
    """

    charts: tuple[Chart, ...]
    series: FloatArray
    celsius: FloatArray
    measured: bool
    prior: ChartPrior
    predicted: Predicted
    up: FloatArray
    down: FloatArray
    other: FloatArray
    one_night: float
    trend: float
    other_threshold: float
    allowed: FloatArray
    alarms: tuple[Alarm, ...]

    @property
    def scores(self) -> FloatArray:
        """(N, c) standard normal where nothing changes."""
        return self.predicted.scores


def watch(
    values: FloatArray,
    celsius: FloatArray | None,
    clean: BoolArray,
    spread: FloatArray,
    within: FloatArray,
    prior: NightPrior,
    patterns: Sequence[Pattern],
    geometry: Geometry,
    settings: DriftSettings,
) -> Watch:
    """Run all charts and look at the last night.

    Args:
        values: (N, b), the baseline first.
        celsius: (N, n) per joint; None where none was recorded.
        clean: (N,) nights that teach what is usual.
        spread: (b, b) covariance of a night: what the charts' weights rest on.
        within: (b, b) within a run.
        prior: of the nights.
        patterns: the effects.
        geometry: of the trajectory.
        settings: the false alarms allowed, the tolerance, and the nights of learning.
    """
    charts = _charts(patterns)
    weights = _functionals(charts, spread)
    measured = celsius is not None
    if celsius is None:
        of_charts = [chart.pattern for chart in charts]
        warm = warmth_of_gears(values, within + prior.covariance, of_charts, prior.unmeasured)
    else:
        warm = _temperatures(celsius, [chart.pattern for chart in charts], settings)
    series = values @ weights
    chart_prior = _chart_prior(charts, weights, within, prior, measured, settings)
    predicted = predict(series, warm, clean, chart_prior)
    first = min(1 + int(np.searchsorted(np.cumsum(clean[1:]), settings.learning_nights)) + 1, len(values) - 1)
    other = _other(values, None if celsius is None else celsius.mean(axis=1), clean, spread, first)
    budget = budget_per_night(settings.false_alarms_per_year, settings.nights_per_year)
    limits = (
        one_night_threshold(budget.one_night, len(charts)),
        trend_threshold(budget.trend, len(charts)),
        one_night_threshold(budget.other, 1, sides=1),
    )
    up, down = cusum(np.where(_follows_seasons(charts, measured), np.nan, predicted.scores))
    # What nothing explains has to be there again the next night: how the arm varies is not normal far out.
    lasting = float(np.min(other[-2:])) if other.size > 1 else np.nan
    words = [chart.words for chart in charts]
    alarms = _alarms(words, predicted.scores[-1], np.maximum(up[-1], down[-1]), lasting, limits)
    per_unit = np.array([largest_share(chart.direction, geometry) for chart in charts])
    is_warmth = np.array([chart.pattern.effect == WARMTH for chart in charts])
    per_unit = np.where(is_warmth, settings.tolerance / settings.possible_warmth, per_unit)
    alarms = alarms or _large(charts, predicted.scores[-1], np.abs(predicted.error[-1]) * per_unit, settings)
    allowed = _allowed(charts, predicted, limits[0], per_unit, settings)
    return Watch(
        charts, series, warm, measured, chart_prior, predicted, up, down, other, *limits, allowed, alarms
    )


def _charts(patterns: Sequence[Pattern]) -> tuple[Chart, ...]:
    several = [pattern.directions.shape[1] > 1 for pattern in patterns]
    return tuple(
        Chart(f"{p.words} ({k + 1})" if many else p.words, p, direction, p.units[k])
        for p, many in zip(patterns, several, strict=True)
        for k, direction in enumerate(p.directions.T)
    )


def _functionals(charts: Sequence[Chart], spread: FloatArray) -> FloatArray:
    """Weights (b, c) that read each amount off the parameters with the least variance: S⁻¹p/(pᵀS⁻¹p)."""
    columns = np.column_stack([chart.direction for chart in charts])
    weighted = solve_covariance(spread, columns)
    return np.asarray(weighted / np.einsum("bc,bc->c", columns, weighted))


def _chart_prior(
    charts: Sequence[Chart],
    weights: FloatArray,
    within: FloatArray,
    prior: NightPrior,
    measured: bool,
    settings: DriftSettings,
) -> ChartPrior:
    # Some weeks of a hall without a thermometer do not show what its year holds.
    unseen = _follows_seasons(charts, measured)
    # Where the other gears tell the warmth, a chart knows the hall as well as a thermometer does.
    told = prior.covariance - (1.0 - (settings.thermometer_sigma / settings.hall_sigma) ** 2) * prior.hall
    variance = [
        np.einsum("bc,bd,dc->c", weights, within + known, weights) for known in (told, prior.covariance)
    ]
    steep = np.sqrt(np.einsum("bc,bd,dc->c", weights, prior.slope_covariance, weights))
    return ChartPrior(
        np.sqrt(np.where(unseen, variance[1], variance[0])),
        unseen.astype(np.float64),
        np.where(unseen, 0.0, prior.slope @ weights),
        np.where(unseen, 0.0, steep),
    )


def _follows_seasons(charts: Sequence[Chart], measured: bool) -> BoolArray:
    """(c,) charts whose slow course says nothing: the warmth of all gears where no thermometer tells it."""
    return np.array([chart.pattern.effect == WARMTH and not measured for chart in charts])


def _temperatures(celsius: FloatArray, patterns: Sequence[Pattern], settings: DriftSettings) -> FloatArray:
    """(N, c) temperature of each chart beside the baseline's, so that a line describes friction.

    Friction falls exponentially with the warmth of its gear (as the viscosity of its grease does, after
    Reynolds 1886): over 12 K a line would be off by ½(0.015 · 12)² = 1.6 % of viscous friction. Kelvin are
    counted as (1 − exp(−aΔ))/a with the prior's coefficient a.
    """
    mean = celsius.mean(axis=1)
    found = np.column_stack([mean if p.joint is None else celsius[:, p.joint - 1] for p in patterns])
    found = found - found[0]
    share = np.array([warmth_share(pattern.effect, settings)[0] for pattern in patterns])
    curved = -np.expm1(-share * found) / np.where(share > 0.0, share, 1.0)
    return np.asarray(np.where(share > 0.0, curved, found))


def _other(
    values: FloatArray, celsius: FloatArray | None, clean: BoolArray, spread: FloatArray, first: int
) -> FloatArray:
    """(N,) how unusually far all parameters together are off, beside the judged clean nights before.

    The cube root of Wald's statistic is nearly normal (Wilson and Hilferty 1931); its own mean and variance
    over the nights stand in for what is not known of the run-to-run covariance.
    """
    found = recursive_residuals(values, celsius, clean)
    size = np.full(values.shape[0], np.nan)
    for k in first + np.flatnonzero(np.isfinite(found.error[first:]).all(axis=1)):
        size[k] = max(float(found.error[k] @ solve_covariance(spread, found.error[k])), 0.0) ** (1 / 3)
    other = np.full(values.shape[0], np.nan)
    judged = size[first:, np.newaxis]
    if judged.size > 2:
        later: Recursive = recursive_residuals(judged, None, clean[first:])
        enough = later.df >= _LEAST_DF
        other[first:] = np.where(enough, normal_scores(later)[:, 0], np.nan)
    return other


_LEAST_DF = 8


def _alarms(
    names: Sequence[str],
    scores: FloatArray,
    sums: FloatArray,
    other: float,
    limits: tuple[float, float, float],
) -> tuple[Alarm, ...]:
    one_night, trend, rest = limits
    found = [
        Alarm(name, "one night", abs(float(score)), one_night)
        for name, score in zip(names, scores, strict=True)
        if abs(score) > one_night
    ]
    found += [
        Alarm(name, "trend", float(value), trend)
        for name, value in zip(names, sums, strict=True)
        if value > trend
    ]
    if not found and other > rest:
        found.append(Alarm(OTHER, "anything else", other, rest))
    return tuple(found)


def _large(
    charts: Sequence[Chart], scores: FloatArray, shares: FloatArray, settings: DriftSettings
) -> tuple[Alarm, ...]:
    """Charts off by more torque than the tolerance with less certainty than an alarm otherwise asks for.

    All gears together are judged by kelvin: a hall may differ by so much, and by no more.
    """
    found = []
    for chart, score, share in zip(charts, np.abs(scores), shares, strict=True):
        limit = _SERIOUS_DOUBT if share > 2.0 * settings.tolerance else _DOUBT
        if chart.pattern.effect == WARMTH:
            limit = _SERIOUS_DOUBT
        if share > settings.tolerance and score > limit:
            found.append(Alarm(chart.words, "size", float(score), limit))
    return tuple(found)


def _allowed(
    charts: Sequence[Chart], predicted: Predicted, limit: float, per_unit: FloatArray, settings: DriftSettings
) -> FloatArray:
    """(c,) amounts up to which neither the chart of one night nor the size of a change would speak."""
    found = predicted.allowed(limit)
    warmth = np.array([chart.pattern.effect == WARMTH for chart in charts])
    for score, times in ((_DOUBT, 1.0), (_SERIOUS_DOUBT, np.where(warmth, 1.0, 2.0))):
        sure = np.maximum(predicted.allowed(score), times * settings.tolerance / per_unit)
        found = np.where(warmth & (score == _DOUBT), found, np.minimum(found, sure))
    return np.asarray(found)
