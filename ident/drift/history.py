"""The nights of an arm as arrays, and what the prior and the clean ones among them make of the last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.drift.geometry import Geometry
from ident.drift.patterns import Pattern, patterns_of, with_warmth
from ident.drift.prior import NIGHTS, NightPrior, posterior_covariance, prior_of
from ident.drift.run_to_run import run_to_run_covariance, temperature_slopes
from ident.drift.values import DriftSettings, Night
from ident.errors import IdentificationError
from robots.arrays import BoolArray, FloatArray

_LEAST_NIGHTS = 5
"""Clean nights from which a run-to-run covariance is estimated beside the prior."""


@dataclass(frozen=True)
class Series:
    """The baseline and the nights after it, as arrays."""

    nights: tuple[Night, ...]
    values: FloatArray
    day: FloatArray
    celsius: FloatArray | None
    """(N, n); None where any night has none."""

    @classmethod
    def of(cls, baseline: Night, nights: Sequence[Night]) -> Series:
        if not nights:
            raise IdentificationError("no night to compare with the baseline")
        every = (baseline, *nights)
        for night in every:
            if night.values.shape != baseline.values.shape:
                raise IdentificationError(
                    f"{label_of(night)}: {night.values.size} parameters; allowed: the"
                    f" {baseline.values.size} of the baseline"
                )
        warm = [night.celsius for night in every if night.celsius is not None]
        return cls(
            every,
            np.array([night.values for night in every]),
            np.array([night.day for night in every], dtype=np.float64),
            np.array(warm) if len(warm) == len(every) else None,
        )

    @property
    def unmeasured(self) -> str | None:
        """The first night without a temperature, where others have one."""
        without = [night for night in self.nights if night.celsius is None]
        return label_of(without[0]) if 0 < len(without) < len(self.nights) else None

    @property
    def clean(self) -> BoolArray:
        """(N,) nights that teach; tonight does not."""
        return np.array([night.clean for night in self.nights[:-1]] + [False])

    def mean_celsius(self) -> FloatArray | None:
        """(N,) over the joints."""
        return None if self.celsius is None else self.celsius.mean(axis=1)


@dataclass(frozen=True)
class Expected:
    """What the prior and the clean nights make of tonight.

    Attributes:
        patterns: the effects, the warmth of all gears among them.
        prior: before there were nights.
        nights: clean ones, the baseline's among them.
        within: (b, b) covariance within a run.
        spread: (b, b) of a night.
        slopes, slope_sigma: (b,) change per kelvin, and its deviation.
        tonight: (b,) change beside the clean nights at tonight's temperature.
        leverage: of that.
    """

    patterns: tuple[Pattern, ...]
    prior: NightPrior
    nights: int
    within: FloatArray
    spread: FloatArray
    slopes: FloatArray
    slope_sigma: FloatArray
    tonight: FloatArray
    leverage: float


def expected_of(series: Series, geometry: Geometry, settings: DriftSettings) -> Expected:
    patterns = with_warmth(patterns_of(geometry), settings)
    prior = prior_of(patterns, geometry, series.celsius is not None, settings)
    clean = np.flatnonzero(series.clean[:-1])
    taught = clean if clean.size else np.array([0])
    celsius = series.mean_celsius()
    weight = NIGHTS * settings.thermometer_sigma**2
    warm = None if celsius is None else celsius[taught]
    slopes = temperature_slopes(series.values[taught], warm, prior.slope, weight)
    within, spread = _covariance_of_a_night(
        series, taught[: settings.learning_nights], prior, slopes, settings
    )
    apart = 0.0 if celsius is None or warm is None else float(celsius[-1] - warm.mean())
    tonight = series.values[-1] - series.values[taught].mean(axis=0) - slopes * apart
    known = weight if warm is None else float(((warm - warm.mean()) ** 2).sum()) + weight
    leverage = 1.0 / taught.size + apart**2 / known
    sigma = np.sqrt(np.diag(spread) / known)
    return Expected(patterns, prior, int(clean.size), within, spread, slopes, sigma, tonight, leverage)


def label_of(night: Night) -> str:
    return night.label or f"day {night.day:g}"


def _covariance_of_a_night(
    series: Series, learned: np.ndarray, prior: NightPrior, slopes: FloatArray, settings: DriftSettings
) -> tuple[FloatArray, FloatArray]:
    """(b, b) within a run, and with what the arm varies by from run to run and a thermometer may be wrong by.

    The last one matters once the season has left the temperatures that were learned: a sensor that shows a
    part of the gears' warmth gives slopes that are too small, so a colder hall looks like more friction.
    """
    within = np.asarray(np.mean([series.nights[k].covariance for k in learned], axis=0))
    found = None
    if learned.size >= _LEAST_NIGHTS:
        celsius = series.mean_celsius()
        warm = None if celsius is None else celsius[learned]
        found = run_to_run_covariance(series.values[learned], within, warm)
        if warm is not None:
            found = found + settings.thermometer_sigma**2 * np.outer(slopes, slopes)
    enough = settings.learning_nights
    return within, within + posterior_covariance(prior, found, int(learned.size), enough)
