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
from ident.drift.patterns import Pattern
from ident.drift.run_to_run import Recursive, recursive_residuals
from ident.drift.values import Alarm, DriftSettings
from ident.drift.wald import solve_covariance
from robots.arrays import BoolArray, FloatArray

OTHER = "anything else"


@dataclass(frozen=True)
class Watch:
    """The charts over all nights.

    Attributes:
        charts: (c,) words.
        series: (N, c) amount of each effect, as if nothing else had moved.
        celsius: (N, c) temperature that belongs to each; zeros where none was recorded.
        scores: (N, c) standard normal where nothing changes.
        up, down: (N, c) CUSUMs.
        other: (N,) scores of the size of what is left in all parameters; nan before it is known.
        one_night, trend, other_threshold: thresholds.
        first: first night that is judged.
        alarms: of the last night.
    """

    charts: tuple[str, ...]
    series: FloatArray
    celsius: FloatArray
    scores: FloatArray
    up: FloatArray
    down: FloatArray
    other: FloatArray
    one_night: float
    trend: float
    other_threshold: float
    first: int
    alarms: tuple[Alarm, ...]


def watch(
    values: FloatArray,
    day: FloatArray,
    celsius: FloatArray | None,
    clean: BoolArray,
    spread: FloatArray,
    patterns: Sequence[Pattern],
    settings: DriftSettings,
) -> Watch:
    """Run all charts and look at the last night.

    Args:
        values: (N, b), the baseline first.
        day: (N,).
        celsius: (N, n) per joint; None where none was recorded.
        clean: (N,) nights that teach what is usual.
        spread: (b, b) covariance of a night.
        patterns: the effects.
        settings: the false alarms allowed, and the nights of learning.
    """
    names, weights, joints = _functionals(patterns, spread)
    warm = _temperatures(celsius, joints, values.shape[0])
    series = values @ weights
    scores = _scores(series, None if celsius is None else warm, clean)
    first = 1 + int(np.searchsorted(np.cumsum(clean[1:]), settings.learning_nights)) + 1
    first = min(first, values.shape[0] - 1)
    scores[:first] = np.nan
    other = _other(values, None if celsius is None else celsius.mean(axis=1), clean, spread, first)
    budget = budget_per_night(settings.false_alarms_per_year, settings.nights_per_year)
    limits = (
        one_night_threshold(budget.one_night, len(names)),
        trend_threshold(budget.trend, len(names)),
        one_night_threshold(budget.other, 1, sides=1),
    )
    up, down = cusum(scores)
    # What nothing explains has to be there again the next night: how the arm varies is not normal far out.
    lasting = float(np.min(other[-2:])) if other.size > 1 else np.nan
    alarms = _alarms(names, scores[-1], np.maximum(up[-1], down[-1]), lasting, limits)
    return Watch(names, series, warm, scores, up, down, other, *limits, first, alarms)


def _functionals(
    patterns: Sequence[Pattern], spread: FloatArray
) -> tuple[tuple[str, ...], FloatArray, tuple[int | None, ...]]:
    """Weights (b, c) that read each amount off the parameters with the least variance: S⁻¹p/(pᵀS⁻¹p)."""
    names, columns, joints = [], [], []
    for pattern in patterns:
        for k, direction in enumerate(pattern.directions.T):
            weighted = solve_covariance(spread, direction)
            columns.append(weighted / float(direction @ weighted))
            several = pattern.directions.shape[1] > 1
            names.append(f"{pattern.words} ({k + 1})" if several else pattern.words)
            joints.append(pattern.joint)
    return tuple(names), np.column_stack(columns), tuple(joints)


def _temperatures(celsius: FloatArray | None, joints: Sequence[int | None], nights: int) -> FloatArray:
    if celsius is None:
        return np.zeros((nights, len(joints)))
    mean = celsius.mean(axis=1)
    return np.column_stack([mean if joint is None else celsius[:, joint - 1] for joint in joints])


def _scores(series: FloatArray, celsius: FloatArray | None, clean: BoolArray) -> FloatArray:
    if celsius is None:
        return normal_scores(recursive_residuals(series, None, clean))
    scores = np.full(series.shape, np.nan)
    unique, place = np.unique(celsius, axis=1, return_inverse=True)
    for k in range(unique.shape[1]):
        own = np.flatnonzero(place == k)
        scores[:, own] = normal_scores(recursive_residuals(series[:, own], unique[:, k], clean))
    return scores


def _other(
    values: FloatArray, celsius: FloatArray | None, clean: BoolArray, spread: FloatArray, first: int
) -> FloatArray:
    """(N,) how unusually far all parameters together are off, beside the judged clean nights before.

    The cube root of Wald's statistic is nearly normal (Wilson and Hilferty 1931); its own mean and variance
    over the nights stand in for what is not known of the run-to-run covariance.
    """
    found = recursive_residuals(values, celsius, clean)
    size = np.full(values.shape[0], np.nan)
    for k in range(first, values.shape[0]):
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
