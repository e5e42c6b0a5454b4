"""Control charts with a stated number of false alarms: one night (Shewhart) and a trend (CUSUM)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.optimize import brentq

from ident.drift.run_to_run import Recursive
from robots.arrays import FloatArray

ALLOWANCE = 0.5
"""k of the CUSUM: tuned to a shift of one run-to-run deviation."""
_CLIP = 4.0
"""No single night moves a CUSUM by more: one bad night is what the chart of one night is for."""
_OVERSHOOT = 1.166
"""Siegmund (1985): the normal random walk overshoots the boundary by twice 0.583."""
_MOST_CORRELATION = 0.8
_LEAST_NIGHTS = 10


@dataclass(frozen=True)
class Budget:
    """Expected false alarms per night that each kind of chart may use, over all its charts and both signs."""

    one_night: float
    trend: float
    other: float


def budget_per_night(false_alarms_per_year: float, nights_per_year: float) -> Budget:
    """Two fifths of the false alarms for single nights, two for trends, one for everything else."""
    night = false_alarms_per_year / nights_per_year
    return Budget(0.4 * night, 0.4 * night, 0.2 * night)


def normal_scores(recursive: Recursive) -> FloatArray:
    """(N, c) standard normal where nothing changes: Φ⁻¹ of Student's distribution (Hawkins 1987).

    nan where too few nights came before.
    """
    t = recursive.error / recursive.scale
    df = np.broadcast_to(recursive.df[:, np.newaxis], t.shape)
    with np.errstate(invalid="ignore"):
        tail = stats.t.logsf(np.abs(t), np.maximum(df, 1.0))
    score = np.where(np.isfinite(tail), -_normal_quantile_of_log(np.asarray(tail)), np.nan)
    return np.asarray(np.sign(t) * score)


def one_night_threshold(rate: float, charts: int, sides: int = 2) -> float:
    """Score beyond which one of ``charts`` is found, ``rate`` times per night by chance (Bonferroni)."""
    return float(stats.norm.isf(rate / (charts * sides)))


def run_length(threshold: float, allowance: float = ALLOWANCE) -> float:
    """Mean number of nights to a false alarm of a one-sided CUSUM of standard normals (Siegmund 1985)."""
    b = threshold + _OVERSHOOT
    return float((np.expm1(2 * allowance * b) - 2 * allowance * b) / (2 * allowance**2))


def trend_threshold(rate: float, charts: int, allowance: float = ALLOWANCE) -> float:
    """h of two-sided CUSUMs, ``charts`` of them, with ``rate`` false alarms per night altogether."""
    wanted = 2 * charts / rate
    return float(brentq(lambda h: np.log(run_length(h, allowance) / wanted), 0.01, 200.0))


def cusum(scores: FloatArray, allowance: float = ALLOWANCE) -> tuple[FloatArray, FloatArray]:
    """Page's sums up and down, (N, c) each; a night without a score leaves them as they are.

    Scores that hang together from night to night are divided by √((1 + ρ)/(1 − ρ)), by which the variance of
    their sum is larger, with ρ > 0 the autocorrelation of the nights before.
    """
    scaled = np.clip(scores / _stretch(scores), -_CLIP, _CLIP)
    up, down = np.zeros(scores.shape), np.zeros(scores.shape)
    high, low = np.zeros(scores.shape[1]), np.zeros(scores.shape[1])
    for k, row in enumerate(np.nan_to_num(scaled, nan=0.0)):
        known = np.isfinite(scaled[k])
        high = np.where(known, np.maximum(0.0, high + row - allowance), high)
        low = np.where(known, np.maximum(0.0, low - row - allowance), low)
        up[k], down[k] = high, low
    return up, down


def _stretch(scores: FloatArray) -> FloatArray:
    """(N, c) by which the deviation of sums exceeds that of independent nights, from those before each."""
    known = np.nan_to_num(np.clip(scores, -_CLIP, _CLIP), nan=0.0)
    products = np.cumsum(known[1:] * known[:-1], axis=0)
    squares = np.cumsum(known**2, axis=0)
    found = np.ones(scores.shape)
    counts = np.cumsum(np.isfinite(scores), axis=0)
    for k in range(2, scores.shape[0]):
        with np.errstate(invalid="ignore", divide="ignore"):
            rho = products[k - 2] / squares[k - 1]
        sure = counts[k - 1] >= _LEAST_NIGHTS
        # Its own chance error would stretch the scores of an arm without any: two deviations are taken off.
        rho = rho - 2.0 / np.sqrt(np.maximum(counts[k - 1], 1))
        rho = np.where(sure & np.isfinite(rho), np.clip(rho, 0.0, _MOST_CORRELATION), 0.0)
        found[k] = np.sqrt((1 + rho) / (1 - rho))
    return found


def _normal_quantile_of_log(log_tail: FloatArray) -> FloatArray:
    """Φ⁻¹(exp(log_tail)) also where the probability underflows."""
    from scipy.special import ndtri_exp

    return np.asarray(ndtri_exp(log_tail))
