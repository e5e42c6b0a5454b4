"""What is known of an arm's nights before there are any: warmth and friction, and how steady the rest is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.drift.geometry import Geometry
from ident.drift.patterns import WARMTH, Pattern, warmth_share
from ident.drift.values import DriftSettings
from robots.arrays import FloatArray

NIGHTS = 5
"""Nights that the prior covariance counts as beside those of the arm itself."""
_STEADY = 0.001
"""Run-to-run deviation of what warmth does not move: share of the torque of the joint that shows it most."""
_STEADY_PER_KELVIN = 0.0005
"""The same for each kelvin: magnets and strain gauges lose 0.02 to 0.1 % a kelvin."""
_RIDGE = 1e-4
"""Least run-to-run deviation of a parameter, as a share of the torque: keeps the covariance regular."""


@dataclass(frozen=True)
class NightPrior:
    """Normal priors of the base parameters of a night.

    Attributes:
        covariance: (b, b) between nights, beyond that within a run.
        slope: (b,) mean change per kelvin of measured warmth.
        slope_covariance: (b, b) of it.
        warmth: (b,) change per kelvin that all gears are colder together.
        unmeasured: deviation of the warmth that no thermometer shows, K.
        hall: (b, b) what it makes of the parameters where there is no thermometer: some weeks do not show
            what the hall's year holds. Zeros where there is one.
    """

    covariance: FloatArray
    slope: FloatArray
    slope_covariance: FloatArray
    warmth: FloatArray
    unmeasured: float
    hall: FloatArray


def prior_of(
    patterns: Sequence[Pattern], geometry: Geometry, measured: bool, settings: DriftSettings
) -> NightPrior:
    """The priors of an arm.

    Friction follows the warmth of its gear; how much for each kelvin differs from joint to joint. All gears
    share the hall's warmth, and each has some of its own.

    Args:
        patterns: the effects.
        geometry: with the baseline's parameters.
        measured: whether every night has a temperature.
        settings: coefficients and spreads.
    """
    size = geometry.beta.size
    coefficients, slopes = np.zeros((size, size)), np.zeros((size, size))
    steady = np.zeros((size, size))
    own: dict[int, FloatArray] = {}
    warmth = np.zeros(size)
    for pattern in patterns:
        share, sigma = warmth_share(pattern.effect, settings)
        if pattern.effect == WARMTH:
            continue
        if share and pattern.scale is not None and pattern.joint is not None:
            direction = pattern.directions[:, 0] * pattern.scale
            coefficients += sigma**2 * np.outer(direction, direction)
            own[pattern.joint] = own.get(pattern.joint, np.zeros(size)) + share * direction
            warmth += share * direction
        for direction in pattern.directions.T:
            unit = direction / largest_share(direction, geometry)
            steady += _STEADY**2 * np.outer(unit, unit)
            slopes += _STEADY_PER_KELVIN**2 * np.outer(unit, unit)
    unmeasured = settings.thermometer_sigma if measured else settings.hall_sigma
    by_warmth = unmeasured**2 * (np.outer(warmth, warmth) + coefficients)
    spread = by_warmth + steady
    for direction in own.values():
        spread += settings.gear_sigma**2 * np.outer(direction, direction)
    ridge = np.diag([(_RIDGE / largest_share(row, geometry)) ** 2 for row in np.eye(size)])
    hall = np.zeros((size, size)) if measured else by_warmth
    return NightPrior(spread + ridge, -warmth, coefficients + slopes, warmth, unmeasured, hall)


def largest_share(direction: FloatArray, geometry: Geometry) -> float:
    """Torque that a change (b,) makes on the joint that shows it most, as a share of that joint's torque."""
    usual = np.maximum(geometry.torque_rms(geometry.beta), np.finfo(float).tiny)
    return float(np.max(geometry.torque_rms(direction) / usual)) or 1.0


def posterior_covariance(prior: NightPrior, found: FloatArray | None, nights: int, enough: int) -> FloatArray:
    """(b, b) between nights: the prior counts as ``NIGHTS`` of them, and as fewer the more there are.

    Args:
        prior: of the arm.
        found: (b, b) that the arm's own nights show; None where there are too few.
        nights: that it was found from.
        enough: nights from which on the prior counts no more.
    """
    if found is None:
        return prior.covariance
    weight = NIGHTS * max(0.0, 1.0 - nights / enough)
    found = found + prior.hall
    return np.asarray((weight * prior.covariance + nights * found) / (weight + nights))
