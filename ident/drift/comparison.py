"""Tonight beside the baseline and the nights since: has anything moved, what, where and since when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from ident.drift.change_point import Onset, Warmth, change_shape, find_change
from ident.drift.doubt import course_of, is_doubtful, is_own_warmth, usual_of, with_kelvin
from ident.drift.geometry import Geometry
from ident.drift.history import Expected, Series, expected_of, label_of
from ident.drift.naming import UNEXPLAINED, Explained, effect_amounts, explain
from ident.drift.patterns import Pattern
from ident.drift.prior import NIGHTS as PRIOR_NIGHTS
from ident.drift.values import (
    Alarm,
    ChangePoint,
    Comparison,
    DriftSettings,
    DriftTest,
    MovedParameter,
    Night,
    Stage,
)
from ident.drift.wald import holm, solve_covariance, wald_test
from ident.drift.watch import OTHER, Watch, watch
from ident.drift.words import sentence_of, strongest
from robots.arrays import FloatArray

_DEFAULTS = DriftSettings()


def compare(
    baseline: Night, nights: Sequence[Night], geometry: Geometry, settings: DriftSettings = _DEFAULTS
) -> Comparison:
    """Compare the last of the nights with the baseline and with the clean nights before it.

    Args:
        baseline: the accepted identification.
        nights: since then, oldest first; the last is the one that is judged, at least one.
        geometry: of the accepted trajectory.
        settings: false alarms allowed, tolerance, nights of learning.

    Raises:
        IdentificationError: no night, other parameters than the baseline's, or a covariance that is none.
    """
    series = Series.of(baseline, nights)
    usual = expected_of(series, geometry, settings)
    watched = watch_of(series, usual, geometry, settings)
    between = _between(usual)
    stage: Stage = "learning" if usual.nights < settings.learning_nights else "watching"
    alarms = watched.alarms
    if stage == "learning" and not alarms:
        alarms = _whole_change(between, usual, geometry, settings)
    unchanged = _unchanged(baseline, series, geometry, usual, watched, between, stage)
    if not alarms:
        return sentence_of(unchanged, usual.nights, settings)
    found = _changed(unchanged, series, geometry, usual, watched, alarms, settings)
    return sentence_of(found or unchanged, usual.nights, settings)


def watch_of(series: Series, usual: Expected, geometry: Geometry, settings: DriftSettings) -> Watch:
    """The charts over all nights of a series."""
    return watch(
        series.values,
        series.celsius,
        series.clean,
        usual.spread,
        usual.within,
        usual.prior,
        usual.patterns,
        geometry,
        settings,
    )


def _between(usual: Expected) -> DriftTest:
    return wald_test(
        usual.tonight,
        np.zeros_like(usual.tonight),
        usual.spread * (1.0 + usual.leverage),
        name="Wald, run-to-run variation included",
        null="tonight's parameters are those of the clean nights at this temperature",
        runs=max(usual.nights, 1) + PRIOR_NIGHTS,
    )


def _whole_change(
    between: DriftTest, usual: Expected, geometry: Geometry, settings: DriftSettings
) -> tuple[Alarm, ...]:
    """While the chart of everything else knows too little: all parameters, beyond what warmth makes."""
    level = settings.false_alarms_per_year / settings.nights_per_year
    if between.p_value >= level:
        return ()
    warmth = usual.prior.covariance @ solve_covariance(usual.spread, usual.tonight)
    beyond = geometry.torque_rms(usual.tonight - warmth)
    if not (beyond > settings.tolerance * geometry.torque_rms(geometry.beta)).any():
        return ()
    return (Alarm(OTHER, "wald", between.statistic, float(stats.f.isf(level, *between.df))),)


def _unchanged(
    baseline: Night,
    series: Series,
    geometry: Geometry,
    usual: Expected,
    watched: Watch,
    between: DriftTest,
    stage: Stage,
) -> Comparison:
    colder = None
    if series.celsius is not None:
        taught = series.celsius[:-1][series.clean[:-1]] if usual.nights else series.celsius[:1]
        apart = taught.mean(axis=0) - series.celsius[-1]
        colder = float(apart[np.argmax(np.abs(apart))])
    return Comparison(
        state="unchanged",
        stage=stage,
        sentence="",
        wald=_one_run(baseline, series.nights[-1]),
        between_runs=between,
        parameters=(),
        changes=(),
        since=None,
        alarms=(),
        torque_change=geometry.torque_rms(usual.tonight),
        torque_rms=geometry.torque_rms(geometry.beta),
        torque_units=tuple(joint.torque_unit for joint in geometry.base.model.robot.joint),
        large=False,
        colder=colder,
        unmeasured=series.unmeasured,
        usual=usual_of(watched, usual),
        course=course_of(watched, series, ()),
    )


def _changed(
    unchanged: Comparison,
    series: Series,
    geometry: Geometry,
    usual: Expected,
    watched: Watch,
    alarms: tuple[Alarm, ...],
    settings: DriftSettings,
) -> Comparison | None:
    """What has moved and since when; None where it is not worth reporting."""
    since = _since(watched, series, alarms, settings)
    pattern = _strongest(alarms, watched)
    celsius = _warmth_beside(pattern, series, watched)
    change, covariance, count = _change(series, usual, since, celsius, settings)
    explained = explain(change, covariance, usual.patterns, geometry, settings.level)
    alone = 0.0 if pattern is None else float(effect_amounts(change, covariance, pattern.directions)[0])
    torque = _torque_of(change, covariance, explained, pattern, geometry)
    rms = unchanged.torque_rms
    if not (torque > settings.negligible * rms).any():
        return None
    if is_own_warmth(explained, pattern, alone, series.celsius is not None, settings):
        return None
    named = tuple(with_kelvin(found, settings) for found in explained.changes)
    doubtful = is_doubtful(named, series.celsius is not None, settings)
    return replace(
        unchanged,
        state="changed",
        parameters=_parameters(change, covariance, geometry, settings.level, count),
        changes=named,
        course=course_of(watched, series, named),
        since=since,
        alarms=alarms,
        torque_change=torque,
        large=bool((torque > settings.tolerance * rms).any()),
        unexplained=explained.unexplained,
        doubtful=doubtful,
    )


def _torque_of(
    change: FloatArray,
    covariance: FloatArray,
    explained: Explained,
    pattern: Pattern | None,
    geometry: Geometry,
) -> FloatArray:
    """(n,) torque that what has moved makes on the trajectory; by ``pattern`` where nothing was named."""
    if not explained.changes:
        if pattern is not None:
            change = pattern.directions @ effect_amounts(change, covariance, pattern.directions)
        return geometry.torque_rms(change)
    # What is named is known better than the change of every parameter at once, unless it is not all.
    torque = np.sqrt(sum(found.torque_rms**2 for found in explained.changes))
    if explained.unexplained.p_value < UNEXPLAINED:
        torque = np.maximum(torque, geometry.torque_rms(change))
    return np.asarray(torque)


def _strongest(alarms: Sequence[Alarm], watched: Watch) -> Pattern | None:
    """Effect whose chart is furthest beyond its threshold; None where all parameters together are."""
    alarm = strongest(alarms)
    return next((chart.pattern for chart in watched.charts if chart.words == alarm.chart), None)


def _one_run(baseline: Night, tonight: Night) -> DriftTest:
    return wald_test(
        tonight.values,
        baseline.values,
        tonight.covariance + baseline.covariance,
        name="Wald, both covariances",
        null="both runs have the same parameters and nothing varies from run to run",
    )


def _since(watched: Watch, series: Series, alarms: Sequence[Alarm], settings: DriftSettings) -> ChangePoint:
    alarm = strongest(alarms)
    words = [chart.words for chart in watched.charts]
    last = len(series.nights) - 1
    onset = Onset(last, "step", last, last, 0.0)
    if alarm.chart in words:
        chart = words.index(alarm.chart)
        weight = PRIOR_NIGHTS * settings.thermometer_sigma**2
        warmth = Warmth(watched.celsius[:, chart], watched.prior.slope[chart], weight)
        onset = find_change(watched.series[:, chart], series.day, warmth, 1)
    label, earliest, latest = (label_of(series.nights[k]) for k in (onset.start, onset.first, onset.last))
    day = float(series.day[onset.start])
    return ChangePoint(onset.start, day, onset.shape, label, earliest, latest, onset.wear)


def _warmth_beside(pattern: Pattern | None, series: Series, watched: Watch) -> FloatArray | None:
    """(N,) warmth that is taken out of the change of all parameters; None where nothing tells it.

    It is that of the chart that the alarm is of; none beside all gears together, which are no measure of
    themselves.
    """
    if pattern is None:
        return series.mean_celsius()
    place = next(k for k, chart in enumerate(watched.charts) if chart.pattern is pattern)
    return watched.celsius[:, place]


def _change(
    series: Series,
    usual: Expected,
    since: ChangePoint,
    celsius: FloatArray | None,
    settings: DriftSettings,
) -> tuple[FloatArray, FloatArray, int]:
    """Change (b,) of all parameters with the shape of the change point, its covariance, and nights left."""
    column = change_shape(series.day, since.index, since.shape)
    matrix, values = np.ones((column.size, 1)), series.values
    if celsius is not None:
        weight = PRIOR_NIGHTS * settings.thermometer_sigma**2
        warmth = Warmth(celsius, usual.prior.slope, weight)
        matrix, values = warmth.regressors(), warmth.observed(values)
        column = np.append(column, 0.0)
    matrix = np.column_stack([matrix, column])
    solution = np.linalg.lstsq(matrix, values, rcond=None)[0]
    inverse = np.linalg.pinv(matrix.T @ matrix, hermitian=True)
    count = len(series.nights) - 2 + PRIOR_NIGHTS
    return solution[-1], usual.spread * inverse[-1, -1], count


def _parameters(
    change: FloatArray, covariance: FloatArray, geometry: Geometry, level: float, df: int
) -> tuple[MovedParameter, ...]:
    sigma = np.sqrt(np.diag(covariance))
    ratio = np.abs(change) / sigma
    p_values = 2 * stats.t.sf(ratio, df)
    corrected = holm(np.asarray(p_values))
    names, leading = geometry.base.names, geometry.base.leading
    found = []
    for k in np.argsort(-ratio, kind="stable"):
        if corrected[k] > level:
            continue
        alone = np.zeros_like(change)
        alone[k] = change[k]
        torque = float(np.linalg.norm(geometry.torque_rms(alone)))
        found.append(
            MovedParameter(
                names[k],
                float(change[k]),
                float(sigma[k]),
                leading[k].unit,
                float(p_values[k]),
                float(corrected[k]),
                torque,
            )
        )
    return tuple(found)
