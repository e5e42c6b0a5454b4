"""Covariance of errors that are correlated along time: Bartlett's kernel (Newey and West 1987, 1994)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.covariances.problem import EstimatedRows
from robots.arrays import FloatArray


@dataclass(frozen=True)
class BartlettHac:
    """Heteroskedasticity and autocorrelation, per joint and per recording.

    Scores are zero where rows are left out, so a lag always is the same time (Parzen 1963).

    Attributes:
        bandwidth: lags with weight; by Newey and West's plug-in rule for each joint and recording where None.
        small_sample: scale by r / (r − b).
    """

    bandwidth: int | None = None
    small_sample: bool = True
    name: str = "hac"

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        total = np.zeros((rows.parameters, rows.parameters))
        for scores, lags in zip(rows.series(rows.scores), self.bandwidths(rows), strict=True):
            total += bartlett_sum(scores, lags)
        factor = rows.count / (rows.count - rows.parameters) if self.small_sample else 1.0
        return factor * total

    def bandwidths(self, rows: EstimatedRows) -> list[int]:
        """Lags of each joint and recording."""
        pieces = rows.series(rows.scores)
        if self.bandwidth is not None:
            return [min(self.bandwidth, piece.shape[0] - 1) for piece in pieces]
        scale = np.sqrt(np.sum(rows.z[rows.used] ** 2, axis=0))
        return [newey_west_bandwidth(np.sum(piece / scale, axis=1)) for piece in pieces]

    def describe(self, rows: EstimatedRows) -> str:
        lags = self.bandwidths(rows)
        how = "given" if self.bandwidth is not None else "Newey-West"
        return f"HAC per joint and recording, Bartlett kernel, {min(lags)} to {max(lags)} lags ({how})"


def bartlett_sum(scores: FloatArray, lags: int) -> FloatArray:
    """Γ₀ + Σ_l (1 − l/(lags + 1)) (Γ_l + Γ_lᵀ) of scores (samples, b); sums, not means."""
    total = np.asarray(scores.T @ scores)
    for lag in range(1, lags + 1):
        gamma = scores[lag:].T @ scores[:-lag]
        total += (1.0 - lag / (lags + 1.0)) * (gamma + gamma.T)
    return total


def newey_west_bandwidth(series: FloatArray) -> int:
    """Plug-in bandwidth of Bartlett's kernel for a series (samples,) (Newey and West 1994)."""
    samples = series.size
    pilot = min(int(np.ceil(4.0 * (samples / 100.0) ** (2.0 / 9.0))), samples - 1)
    moments = np.array([series[lag:] @ series[: samples - lag] for lag in range(pilot + 1)]) / samples
    level = moments[0] + 2.0 * moments[1:].sum()
    if level == 0.0:
        return 0
    slope = 2.0 * np.arange(1, pilot + 1) @ moments[1:]
    rate = 1.1447 * ((slope / level) ** 2) ** (1.0 / 3.0)
    return min(int(np.ceil(rate * samples ** (1.0 / 3.0))), samples - 1)
