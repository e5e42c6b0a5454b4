"""Tonight beside the baseline and the nights since: has anything moved, what, where and since when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ident.drift.change_point import change_shape, find_change
from ident.drift.geometry import Geometry
from ident.drift.learning import beyond_warmth
from ident.drift.naming import Explained, effect_amounts, explain
from ident.drift.patterns import Pattern, patterns_of
from ident.drift.run_to_run import run_to_run_covariance, temperature_slopes
from ident.drift.values import (
    ChangePoint,
    Comparison,
    DriftSettings,
    DriftTest,
    MovedParameter,
    Night,
)
from ident.drift.wald import holm, wald_test
from ident.drift.watch import OTHER, Watch, watch
from ident.drift.words import sentence_of, strongest
from ident.errors import IdentificationError
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
    series = _Series.of(baseline, nights)
    patterns = patterns_of(geometry)
    learned = [night for night in series.nights[:-1] if night.clean][: settings.learning_nights]
    if len(learned) < settings.learning_nights:
        return _learning(baseline, series, geometry, patterns, settings)
    return _watching(baseline, series, geometry, patterns, settings, learned)


@dataclass(frozen=True)
class _Series:
    """The baseline and the nights after it, as arrays."""

    nights: tuple[Night, ...]
    values: FloatArray
    day: FloatArray
    celsius: FloatArray | None
    """(N, n); None where any night has none."""

    @classmethod
    def of(cls, baseline: Night, nights: Sequence[Night]) -> _Series:
        if not nights:
            raise IdentificationError("no night to compare with the baseline")
        every = (baseline, *nights)
        for night in every:
            if night.values.shape != baseline.values.shape:
                raise IdentificationError(
                    f"{_label(night)}: {night.values.size} parameters; allowed: the"
                    f" {baseline.values.size} of the baseline"
                )
        warm = [night.celsius for night in every if night.celsius is not None]
        return cls(
            every,
            np.array([night.values for night in every]),
            np.array([night.day for night in every], dtype=np.float64),
            np.array(warm) if len(warm) == len(every) else None,
        )

    def mean_celsius(self) -> FloatArray | None:
        """(N,) over the joints."""
        return None if self.celsius is None else self.celsius.mean(axis=1)


def _learning(
    baseline: Night,
    series: _Series,
    geometry: Geometry,
    patterns: Sequence[Pattern],
    settings: DriftSettings,
) -> Comparison:
    """Two runs and their covariances: told where significant *and* large, since arms vary from run to run.

    What most of all varies is friction, with the temperature of gears whose slopes are not known yet: only
    what lies beyond the warmth that there may be counts as large.
    """
    tonight = series.nights[-1]
    covariance = tonight.covariance + baseline.covariance
    wald = _one_run(baseline, tonight)
    change = tonight.values - baseline.values
    level = settings.false_alarms_per_year / settings.nights_per_year
    torque, usual = geometry.torque_rms(change), geometry.torque_rms(geometry.beta)
    beyond = geometry.torque_rms(beyond_warmth(change, baseline, tonight, geometry, patterns, settings))
    changed = bool((beyond > settings.tolerance * usual).any()) and wald.p_value < level
    explained = explain(change, covariance, patterns, geometry, settings.level) if changed else None
    moved = _parameters(change, covariance, geometry, settings.level, None) if changed else ()
    return _comparison(
        "changed" if changed else "unchanged",
        series,
        geometry,
        wald,
        None,
        moved,
        explained,
        None,
        None,
        torque,
        settings,
    )


def _watching(
    baseline: Night,
    series: _Series,
    geometry: Geometry,
    patterns: Sequence[Pattern],
    settings: DriftSettings,
    learned: Sequence[Night],
) -> Comparison:
    wald = _one_run(baseline, series.nights[-1])
    spread = _covariance_of_a_night(baseline, learned, [n for n in series.nights[:-1] if n.clean], settings)
    watched = watch(
        series.values,
        series.day,
        series.celsius,
        np.array([n.clean for n in series.nights]),
        spread,
        patterns,
        settings,
    )
    clean = np.array([n.clean for n in series.nights[:-1]] + [False])
    celsius = series.mean_celsius()
    tonight, leverage = _beside_usual(series.values, celsius, clean)
    between = wald_test(
        tonight,
        np.zeros_like(tonight),
        spread * (1.0 + leverage),
        name="Wald, run-to-run variation included",
        null="tonight's parameters are those of the clean nights at this temperature",
        runs=max(int(clean.sum()), 3),
    )
    unchanged = _comparison(
        "unchanged",
        series,
        geometry,
        wald,
        between,
        (),
        None,
        None,
        watched,
        geometry.torque_rms(tonight),
        settings,
    )
    if not watched.alarms:
        return unchanged
    since = _since(watched, series)
    change, covariance, count = _change(series, spread, since)
    explained = explain(change, covariance, patterns, geometry, settings.level)
    if explained.changes:
        # What is named is known better than the change of every parameter at once.
        torque = np.sqrt(sum(found.torque_rms**2 for found in explained.changes))
    else:
        torque = geometry.torque_rms(_strongest(change, covariance, watched, patterns))
    if not (torque > settings.negligible * geometry.torque_rms(geometry.beta)).any():
        return unchanged
    moved = _parameters(change, covariance, geometry, settings.level, count)
    return _comparison(
        "changed", series, geometry, wald, between, moved, explained, since, watched, torque, settings
    )


def _strongest(
    change: FloatArray, covariance: FloatArray, watched: Watch, patterns: Sequence[Pattern]
) -> FloatArray:
    """Change (b,) by the effect whose chart is furthest beyond its threshold; all of it where none is."""
    alarm = strongest(watched.alarms)
    for pattern in patterns:
        if alarm.chart.startswith(pattern.words):
            return pattern.directions @ effect_amounts(change, covariance, pattern.directions)
    return change


def _one_run(baseline: Night, tonight: Night) -> DriftTest:
    return wald_test(
        tonight.values,
        baseline.values,
        tonight.covariance + baseline.covariance,
        name="Wald, both covariances",
        null="both runs have the same parameters and nothing varies from run to run",
    )


def _covariance_of_a_night(
    baseline: Night, learned: Sequence[Night], clean: Sequence[Night], settings: DriftSettings
) -> FloatArray:
    """(b, b) within a run, what the arm varies by from run to run, and what a thermometer may be wrong by.

    The last one matters once the season has left the temperatures that were learned: a sensor that shows a
    part of the gears' warmth gives slopes that are too small, so a colder hall looks like more friction.
    """
    nights = (baseline, *learned) if baseline.clean else learned
    within = np.mean([night.covariance for night in nights], axis=0)
    warm = [night.celsius.mean() for night in nights if night.celsius is not None]
    celsius = np.array(warm) if len(warm) == len(nights) else None
    values = np.array([night.values for night in nights])
    spread = within + run_to_run_covariance(values, within, celsius)
    if celsius is not None:
        known = np.array([night.values for night in clean])
        warmth = np.array([night.celsius.mean() for night in clean if night.celsius is not None])
        slopes = temperature_slopes(known, warmth) * settings.thermometer_sigma
        spread = spread + np.outer(slopes, slopes)
    return np.asarray(spread)


def _beside_usual(
    values: FloatArray, celsius: FloatArray | None, clean: np.ndarray
) -> tuple[FloatArray, float]:
    """Tonight less what the clean nights make of its temperature, (b,), and the leverage of that."""
    known = values[clean]
    if celsius is None:
        return values[-1] - known.mean(axis=0), 1.0 / len(known)
    warm = celsius[clean]
    apart = celsius[-1] - warm.mean()
    expected = known.mean(axis=0) + temperature_slopes(known, warm) * apart
    spread = float(((warm - warm.mean()) ** 2).sum())
    return values[-1] - expected, 1.0 / len(known) + (apart**2 / spread if spread > 0.0 else 0.0)


def _since(watched: Watch, series: _Series) -> ChangePoint:
    alarm = strongest(watched.alarms)
    if alarm.chart == OTHER:
        last = len(series.nights) - 1
        return ChangePoint(last, float(series.day[last]), "step", _label(series.nights[last]))
    chart = watched.charts.index(alarm.chart)
    celsius = None if series.celsius is None else watched.celsius[:, chart]
    index, shape = find_change(watched.series[:, chart], series.day, celsius, watched.first)
    return ChangePoint(index, float(series.day[index]), shape, _label(series.nights[index]))


def _label(night: Night) -> str:
    return night.label or f"day {night.day:g}"


def _change(series: _Series, spread: FloatArray, since: ChangePoint) -> tuple[FloatArray, FloatArray, int]:
    """Change (b,) of all parameters with the shape of the change point, its covariance, and nights left."""
    column = change_shape(series.day, since.index, since.shape)
    celsius = series.mean_celsius()
    design = [np.ones(column.size), column]
    if celsius is not None and np.ptp(celsius) > 0.0:
        design.append(celsius - celsius.mean())
    matrix = np.column_stack(design)
    solution = np.linalg.lstsq(matrix, series.values, rcond=None)[0]
    inverse = np.linalg.pinv(matrix.T @ matrix, hermitian=True)
    return solution[1], spread * inverse[1, 1], column.size - matrix.shape[1]


def _parameters(
    change: FloatArray, covariance: FloatArray, geometry: Geometry, level: float, df: int | None
) -> tuple[MovedParameter, ...]:
    sigma = np.sqrt(np.diag(covariance))
    ratio = np.abs(change) / sigma
    p_values = 2 * (stats.norm.sf(ratio) if df is None else stats.t.sf(ratio, df))
    corrected = holm(np.asarray(p_values))
    names, units = geometry.base.names, geometry.base.units
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
                units[k],
                float(p_values[k]),
                float(corrected[k]),
                torque,
            )
        )
    return tuple(found)


def _comparison(
    state: str,
    series: _Series,
    geometry: Geometry,
    wald: DriftTest,
    between: DriftTest | None,
    moved: tuple[MovedParameter, ...],
    explained: Explained | None,
    since: ChangePoint | None,
    watched: Watch | None,
    torque: FloatArray,
    settings: DriftSettings,
) -> Comparison:
    found = Comparison(
        state="changed" if state == "changed" else "unchanged",
        stage="learning" if watched is None else "watching",
        sentence="",
        wald=wald,
        between_runs=between,
        parameters=moved,
        changes=() if explained is None else explained.changes,
        since=since,
        alarms=() if watched is None or state == "unchanged" else watched.alarms,
        torque_change=torque,
        torque_rms=geometry.torque_rms(geometry.beta),
        large=state == "changed"
        and bool((torque > settings.tolerance * geometry.torque_rms(geometry.beta)).any()),
        unexplained=None if explained is None else explained.unexplained,
    )
    learned = sum(night.clean for night in series.nights[:-1])
    return sentence_of(found, learned, settings)
