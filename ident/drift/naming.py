"""Which effect explains a change of the base parameters: the fewest, with what they leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ident.drift.geometry import Geometry
from ident.drift.patterns import Pattern, payload_inertia
from ident.drift.values import DriftTest, NamedChange
from ident.drift.wald import solve_covariance
from robots.arrays import FloatArray

UNEXPLAINED = 1e-4
"""p-value below which the named changes are not all of it."""
_NEAR = 6.0
"""Drops of the statistic (−2 log likelihood) that differ by less do not tell effects apart."""
_MOST = 3
"""Effects that one comparison names; an arm with more of them wants a diagnosis."""


def effect_amounts(change: FloatArray, covariance: FloatArray, directions: FloatArray) -> FloatArray:
    """Amounts (m,) of one effect that explain a change (b,) best, by generalised least squares."""
    return _gls(change, covariance, directions)[0]


@dataclass(frozen=True)
class _Fit:
    amounts: FloatArray
    covariance: FloatArray
    drop: float


@dataclass(frozen=True)
class Explained:
    """The named changes and a test of what they leave."""

    changes: tuple[NamedChange, ...]
    unexplained: DriftTest


def explain(
    change: FloatArray, covariance: FloatArray, patterns: Sequence[Pattern], geometry: Geometry, level: float
) -> Explained:
    """Name the effects one after the other while each is sure after correction for how many were tried.

    Args:
        change: (b,) of the base parameters.
        covariance: (b, b) of it, run-to-run variation included.
        patterns: the effects to try.
        geometry: of the trajectory.
        level: of the corrected p-values.
    """
    named: list[NamedChange] = []
    taken = np.zeros((change.size, 0))
    while len(named) < _MOST:
        fits = [(pattern, _fit(change, covariance, pattern, taken)) for pattern in patterns]
        ranked = sorted(fits, key=lambda pair: -_merit(pair[0], pair[1]))
        best, fit = ranked[0]
        p_value = float(min(1.0, len(patterns) * stats.chi2.sf(fit.drop, best.directions.shape[1])))
        if p_value > level:
            break
        near = tuple(
            pattern.words
            for pattern, other in ranked[1:]
            if _merit(best, fit) - _merit(pattern, other) < _NEAR
        )
        named.append(_named(best, fit, p_value, geometry, near))
        taken = np.column_stack(
            [taken, best.directions, *([_inertia(geometry)] * (best.effect == "payload"))]
        )
        patterns = [pattern for pattern in patterns if pattern is not best]
    return Explained(tuple(named), _left(change, covariance, taken))


def _merit(pattern: Pattern, fit: _Fit) -> float:
    """Drop of the statistic less what as many free amounts explain by chance (BIC)."""
    return float(fit.drop - pattern.directions.shape[1] * np.log(pattern.directions.shape[0]))


def _inertia(geometry: Geometry) -> FloatArray:
    return payload_inertia(geometry)


def _fit(change: FloatArray, covariance: FloatArray, pattern: Pattern, taken: FloatArray) -> _Fit:
    """Generalised least squares on the effects so far and this one; the drop is over those so far."""
    together = np.column_stack([taken, pattern.directions])
    amounts, spread, explained = _gls(change, covariance, together)
    before = _gls(change, covariance, taken)[2] if taken.shape[1] else 0.0
    own = slice(taken.shape[1], None)
    return _Fit(amounts[own], spread[own, own], explained - before)


def _gls(
    change: FloatArray, covariance: FloatArray, directions: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Amounts, their covariance and dᵀS⁻¹P a; directions that depend on others share what they explain."""
    weighted = solve_covariance(covariance, directions)
    information = directions.T @ weighted
    scale = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), hermitian=True, rcond=1e-10)
    inverse = inverse / np.outer(scale, scale)
    right = weighted.T @ change
    amounts = inverse @ right
    return amounts, inverse, float(right @ amounts)


def _named(
    pattern: Pattern, fit: _Fit, p_value: float, geometry: Geometry, near: tuple[str, ...]
) -> NamedChange:
    size, sigma = float(fit.amounts[0]), float(np.sqrt(fit.covariance[0, 0]))
    torque = geometry.torque_rms(pattern.directions @ fit.amounts)
    unit = pattern.units[0]
    relative = None if pattern.scale is None or pattern.scale == 0.0 else size / pattern.scale
    if pattern.effect == "drive_gain_error":
        # The torque reads larger by a where the gain has become 1/(1 + a) of what it was.
        sigma, size = sigma / (1.0 + size) ** 2, -size / (1.0 + size)
        relative = size
    return NamedChange(
        pattern.effect,
        pattern.joint,
        pattern.words,
        size,
        sigma,
        unit,
        relative,
        fit.drop,
        p_value,
        torque,
        near,
    )


def _left(change: FloatArray, covariance: FloatArray, taken: FloatArray) -> DriftTest:
    total = float(change @ solve_covariance(covariance, change))
    rank = 0
    if taken.shape[1]:
        total -= _gls(change, covariance, taken)[2]
        rank = int(np.linalg.matrix_rank(taken / np.maximum(np.linalg.norm(taken, axis=0), 1e-300)))
    df = change.size - rank
    total = max(total, 0.0)
    return DriftTest(
        "what the named changes leave",
        "nothing else has moved",
        total,
        f"χ²({df})",
        (float(df),),
        float(stats.chi2.sf(total, df)),
    )
